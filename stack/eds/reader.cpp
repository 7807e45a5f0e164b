#include "stack/eds/reader.h"

#include <charconv>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/eds/fields.h"
#include "stack/eds/ini.h"
#include "stack/eds/lists.h"
#include "stack/eds/object.h"
#include "stack/eds/sections.h"
#include "stack/eds/text.h"

namespace linegate::eds {
namespace {

constexpr std::uint64_t kLargestU32 = 0xFFFF'FFFF;
constexpr std::uint8_t kHighestNodeId = 127;
constexpr int kKnownEdsVersion = 4;

class Reader {
 public:
  Reader(std::string_view text, std::string_view file_name, std::uint8_t node_id)
      : report_(file_name), ini_(Ini::parse(text, report_)), context_{report_, node_id} {
    device_.file = file_name;
  }

  Loaded<od::DeviceDescription> read() {
    if (!report_.has_errors() || !ini_.sections().empty()) {
      read_commissioning();
      read_file_info();
      read_device_info();
      read_dummy_usage();
      read_objects();
      complete_identity();
    }
    device_.node_id = context_.node_id;
    Loaded<od::DeviceDescription> loaded;
    if (!report_.has_errors()) {
      loaded.value = std::move(device_);
    }
    loaded.diagnostics = report_.take();
    return loaded;
  }

 private:
  const Section* expected_section(std::string_view name) {
    const Section* section = ini_.find(name);
    if (section == nullptr) {
      report_.warning({}, "there is no section [" + std::string(name) + ']');
    }
    return section;
  }

  void read_commissioning() {
    if (context_.node_id > kHighestNodeId) {
      report_.error({}, "node-ID " + std::to_string(context_.node_id) + " is not in 1 to 127");
    }
    const Section* section = find_commissioning();
    if (section == nullptr) {
      return;
    }
    context_.is_dcf = true;
    const Fields fields(*section, report_);
    device_.node_name = fields.text("NodeName");
    take_node_id(fields);
  }

  const Section* find_commissioning() {
    const Section* found = nullptr;
    for (const Section& section : ini_.sections()) {
      const std::string name = comparable(section.name);
      if (!is_commissioning(name)) {
        continue;
      }
      if (found != nullptr) {
        report_.warning(section.place, "section " + quote(section.name) + " is ignored: there is " +
                                           quote(found->name) + " in line " +
                                           std::to_string(found->place.line));
        continue;
      }
      if (name != "devicecomissioning") {  // so spelt by CiA 306
        report_.warning(section.place,
                        "section " + quote(section.name) + " is read as [DeviceComissioning]");
      }
      found = &section;
    }
    return found;
  }

  void take_node_id(const Fields& fields) {
    const bool needed = context_.node_id == 0;
    const auto number = fields.number("NodeID", 0xFF, needed ? Severity::error : Severity::warning);
    if (!number) {
      return;
    }
    const Place place = fields.find("NodeID")->value_place;
    if (*number == 0 || *number > kHighestNodeId) {
      report_.add(needed ? Severity::error : Severity::warning, place,
                  "NodeID: " + std::to_string(*number) + " is not in 1 to 127");
    } else if (needed) {
      context_.node_id = static_cast<std::uint8_t>(*number);
    } else if (*number != context_.node_id) {
      report_.warning(place, "NodeID: the file is made for node " + std::to_string(*number) +
                                 ", but is used for node " + std::to_string(context_.node_id));
    }
  }

  void read_file_info() {
    const Section* section = expected_section("FileInfo");
    const Entry* entry = section == nullptr ? nullptr : section->find("EDSVersion");
    if (entry == nullptr || entry->value.empty()) {
      return;
    }
    int major = 0;
    const char* end = entry->value.data() + entry->value.size();
    const auto [stop, error] = std::from_chars(entry->value.data(), end, major);
    if (error != std::errc() || (stop != end && *stop != '.')) {
      report_.warning(entry->value_place,
                      "EDSVersion: " + quote(entry->value) + " is not a version; 4.0 is assumed");
    } else if (major > kKnownEdsVersion) {
      report_.warning(entry->value_place, "EDSVersion: " + quote(entry->value) +
                                              " is newer than 4.0; it is read as 4.0");
    }
  }

  void read_device_info() {
    const Section* section = expected_section("DeviceInfo");
    if (section == nullptr) {
      return;
    }
    const Fields fields(*section, report_);
    device_.vendor_name = fields.text("VendorName");
    device_.product_name = fields.text("ProductName");
    device_.vendor_number = number32(fields, "VendorNumber");
    device_.product_number = number32(fields, "ProductNumber");
    device_.revision_number = number32(fields, "RevisionNumber");
    device_.dynamic_mapping = fields.number("Granularity", 64).value_or(1) != 0;
  }

  std::uint32_t number32(const Fields& fields, std::string_view key) {
    const Entry* entry = fields.section().find(key);
    if (entry != nullptr && entry->value.empty()) {
      report_.warning(entry->key_place,
                      std::string(key) + " has no value; what object 1018h says is used");
    }
    return static_cast<std::uint32_t>(fields.number(key, kLargestU32).value_or(0));
  }

  void read_dummy_usage() {
    const Section* section = ini_.find("DummyUsage");
    if (section == nullptr) {
      return;
    }
    const Fields fields(*section, report_);
    for (const char* key : {"Dummy0001", "Dummy0002", "Dummy0003", "Dummy0004", "Dummy0005",
                            "Dummy0006", "Dummy0007"}) {
      if (section->find(key) == nullptr) {
        report_.warning(section->place, quote(section->name) + " has no " + key + "; 0 is assumed");
      }
    }
    for (const Entry& entry : section->entries) {
      const std::string key = lower(entry.key);
      unsigned type = 0;
      const char* end = key.data() + key.size();
      const bool named = key.starts_with("dummy");
      const auto [stop, error] = std::from_chars(key.data() + (named ? 5 : 0), end, type, 16);
      if (!named || error != std::errc() || stop != end || type == 0 || type > 0x1F) {
        report_.warning(entry.key_place,
                        "key " + quote(entry.key) + " is not Dummy0001 to Dummy001F; ignored");
      } else if (fields.flag(entry.key)) {
        device_.dummy_types |= std::uint32_t{1} << type;
      }
    }
  }

  void read_objects() {
    const ObjectLists lists = read_object_lists(ini_, report_);
    const auto objects = sort_sections(ini_, report_);
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
        device_.objects.push_back(*std::move(object));
      }
    }
    if (device_.objects.empty()) {
      report_.error({}, "no object is described; this is no EDS or DCF");
    }
  }

  void report_orphans(std::uint16_t index, const ObjectSections& sections) {
    const auto tell = [&](const Section* section) {
      if (section != nullptr) {
        report_.warning(section->place, quote(section->name) + " is ignored: object " +
                                            hex(index, 4) + " has no section");
      }
    };
    for (const auto& [sub, section] : sections.subs) {
      tell(section);
    }
    tell(sections.names);
    tell(sections.values);
  }

  // Many files leave out in [DeviceInfo] what the identity object says.
  void complete_identity() {
    std::uint32_t* const numbers[] = {&device_.vendor_number, &device_.product_number,
                                      &device_.revision_number};
    for (std::uint8_t sub = 1; sub <= std::size(numbers); ++sub) {
      const od::VariableDescription* variable = std::as_const(device_).find({0x1018, sub});
      std::uint32_t& number = *numbers[sub - 1];
      if (number == 0 && variable != nullptr && variable->value.size() == sizeof number) {
        number = static_cast<std::uint32_t>(load_le(variable->value));
      }
    }
  }

  Report report_;
  Ini ini_;
  Context context_;
  od::DeviceDescription device_;
};

}  // namespace

Loaded<od::DeviceDescription> load(std::string_view text, std::string_view file_name,
                                   std::uint8_t node_id) {
  return Reader(text, file_name, node_id).read();
}

}  // namespace linegate::eds
