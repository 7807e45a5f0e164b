// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/reader.h"

#include <utility>

#include "stack/base/byte_order.h"
#include "stack/eds/lists.h"
#include "stack/eds/object.h"
#include "stack/eds/sections.h"
#include "stack/eds/text.h"
#include "stack/od/objects.h"

namespace linegate::eds {
namespace {

constexpr ListKind kLinks{"ObjectLinks", "linked object", Severity::warning};

class Reader {
 public:
  Reader(const Ini& ini, Report& report, std::uint8_t node_id)
      : ini_(ini), report_(report), context_{report, node_id} {}

  DataSheet read() {
    sheet_.commissioning = read_commissioning(ini_, context_.node_id, report_);
    context_.is_dcf = sheet_.commissioning.has_value();
    sheet_.file = read_file_info(ini_, report_);
    read_device_info(ini_, sheet_, report_);
    sheet_.device.dummy_types = read_dummy_usage(ini_, report_);
    sheet_.comments = read_comments(ini_.find("Comments"), report_);
    sheet_.dynamic_segments = read_dynamic_channels(ini_, report_);
    sheet_.tools = read_tools(ini_, report_);

    const SortedSections sections = sort_sections(ini_, report_);
    read_objects(sections.objects);
    sheet_.modules = read_modules(ini_, sections.modules, context_);
    sheet_.connected_modules = read_connected_modules(ini_, report_);
    connect_modules(ini_, sheet_, context_);
    add_compact_pdos(ini_, sheet_, context_);
    if (sheet_.device.objects.empty()) {
      report_.error({}, "no object is described; this describes no device");
    }
    complete_identity();
    sheet_.device.node_id = context_.node_id;
    if (sheet_.commissioning) {
      sheet_.device.node_name = sheet_.commissioning->node_name;
    }
    return std::move(sheet_);
  }

 private:
  void read_objects(const std::map<std::uint16_t, ObjectSections>& objects) {
    const ObjectLists lists = read_object_lists(ini_, report_);
    if (!lists.present && !objects.empty()) {
      report_.warning({}, "there is no list of objects ([MandatoryObjects] and so on)");
    }
    for (const auto& [index, place] : lists.indices) {
      const auto at = objects.find(index);
      if (at == objects.end() || at->second.object == nullptr) {
        report_.warning(place, "object " + hex(index, 4) + " is listed, but has no section");
      }
    }
    for (const auto& [index, sections] : objects) {
      if (sections.object == nullptr) {
        report_orphans(index, sections);
        continue;
      }
      if (lists.present && !lists.indices.contains(index)) {
        report_.warning(sections.object->place,
                        "object " + hex(index, 4) + " is in no list of objects");
      }
      if (auto object = read_object(index, sections, context_)) {
        sheet_.device.objects.push_back(*std::move(object));
      }
      read_links(index, sections);
    }
  }

  void read_links(std::uint16_t index, const ObjectSections& sections) {
    if (sections.links != nullptr) {
      for (const ListEntry& entry : read_list(*sections.links, kLinks, report_)) {
        sheet_.object_links[index].push_back(entry.value);
      }
    }
  }

  void report_orphans(std::uint16_t index, const ObjectSections& sections) {
    const auto report_ignored = [&](const Section* section) {
      if (section != nullptr) {
        report_.warning(section->place, quote(section->name) + " is ignored: object " +
                                            hex(index, 4) + " has no section");
      }
    };
    for (const auto& [sub, section] : sections.subs) {
      report_ignored(section);
    }
    report_ignored(sections.names);
    report_ignored(sections.values);
    report_ignored(sections.denotations);
    report_ignored(sections.links);
  }

  // Many files omit values in [DeviceInfo] that the identity object has.
  void complete_identity() {
    od::DeviceDescription& device = sheet_.device;
    std::uint32_t* const numbers[] = {&device.vendor_number, &device.product_number,
                                      &device.revision_number};
    for (std::uint8_t sub = 1; sub <= std::size(numbers); ++sub) {
      const od::VariableDescription* variable =
          std::as_const(device).find({od::objects::kIdentity, sub});
      std::uint32_t& number = *numbers[sub - 1];
      if (number == 0 && variable != nullptr && variable->value.size() == sizeof number) {
        number = static_cast<std::uint32_t>(load_le(variable->value));
      }
    }
  }

  const Ini& ini_;
  Report& report_;
  Context context_;
  DataSheet sheet_;
};

}  // namespace

Loaded<DataSheet> read(const Ini& sections, Report report, std::string_view file_name,
                       std::uint8_t node_id) {
  Loaded<DataSheet> loaded;
  if (!report.has_errors() || !sections.sections().empty()) {
    DataSheet sheet = Reader(sections, report, node_id).read();
    if (!report.has_errors()) {
      sheet.device.file = file_name;
      loaded.value = std::move(sheet);
    }
  }
  loaded.diagnostics = report.take();
  return loaded;
}

Loaded<DataSheet> read(std::string_view text, std::string_view file_name, std::uint8_t node_id) {
  Report report(file_name);
  const Ini ini = Ini::parse(text, report);
  return read(ini, std::move(report), file_name, node_id);
}

Loaded<od::DeviceDescription> load(std::string_view text, std::string_view file_name,
                                   std::uint8_t node_id) {
  Loaded<DataSheet> sheet = read(text, file_name, node_id);
  Loaded<od::DeviceDescription> loaded;
  if (sheet.value) {
    loaded.value = std::move(sheet.value->device);
  }
  loaded.diagnostics = std::move(sheet.diagnostics);
  return loaded;
}

}  // namespace linegate::eds
