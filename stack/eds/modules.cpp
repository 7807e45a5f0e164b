// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "stack/eds/lists.h"
#include "stack/eds/object.h"
#include "stack/eds/sections.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {
namespace {

constexpr ListKind kFixed{"NrOfEntries", "index of a fixed object", Severity::warning};
constexpr ListKind kExtended{"NrOfEntries", "index of an extended object", Severity::warning};
constexpr ListKind kConnected{"NrOfEntries", "number of a module", Severity::error};

const Section* connected_section(const Ini& ini) {
  return ini.find("ConnectedModules");
}

// "4", or "0;2" if several modules share a sub-index with two bits each.
void read_count(const Entry& entry, SubExtension& out, Report& report) {
  const std::size_t end = std::min(entry.value.find(';'), entry.value.size());
  const Number count = parse_number(trim(entry.value.substr(0, end)));
  const Number bits = end == entry.value.size() || (count.ok() && count.magnitude != 0)
                          ? Number{}
                          : parse_number(trim(entry.value.substr(end + 1)));
  const bool fits = count.ok() && bits.ok() && !count.negative && !bits.negative &&
                    count.magnitude <= kMostElements && bits.magnitude <= 64 &&
                    (count.magnitude != 0 || bits.magnitude != 0);
  if (!fits) {
    report.warning(entry.value_place, "Count: " + quote(entry.value) +
                                          " is neither a number of sub-indices nor 0;bits; taken "
                                          "as 1");
    out.count = 1;
    return;
  }
  out.count = static_cast<std::uint8_t>(count.magnitude);
  out.bits = static_cast<std::uint8_t>(bits.magnitude);
}

std::optional<SubExtension> read_extension(std::uint16_t index, const Section& section,
                                           Context& context) {
  auto pattern = read_variable(section, 0, context);
  if (!pattern) {
    return std::nullopt;
  }
  SubExtension out;
  out.index = index;
  out.pattern = *std::move(pattern);
  out.count = 1;
  const Fields fields(section, context.report);
  if (const Entry* entry = fields.find("Count")) {
    read_count(*entry, out, context.report);
  }
  out.extend = static_cast<std::uint8_t>(fields.number("ObjExtend", 0xFF).value_or(0));
  return out;
}

void check_list(const Section* section, const ListKind& kind,
                const std::set<std::uint16_t>& described, Report& report) {
  if (section == nullptr) {
    return;
  }
  for (const ListEntry& entry : read_list(*section, kind, report)) {
    if (!described.contains(entry.value)) {
      report.warning(entry.place, "object " + hex(entry.value, 4) +
                                      " of the module is listed, but has no section");
    }
  }
}

Module read_module(std::uint16_t number, const ModuleSections& sections, Context& context) {
  Module out;
  out.number = number;
  if (sections.info != nullptr) {
    const Fields fields(*sections.info, context.report);
    out.product_name = fields.text("ProductName");
    out.product_version = fields.text("ProductVersion");
    out.product_revision = fields.text("ProductRevision");
    out.order_code = fields.text("OrderCode");
  }
  out.comments = read_comments(sections.comments, context.report);
  std::set<std::uint16_t> fixed;
  for (const auto& [index, object] : sections.fixed) {
    fixed.insert(index);
    if (object.object == nullptr) {
      continue;
    }
    if (auto description = read_object(index, object, context)) {
      out.fixed_objects.push_back(*std::move(description));
    }
  }
  std::set<std::uint16_t> extended;
  for (const auto& [index, section] : sections.extension) {
    extended.insert(index);
    if (auto extension = read_extension(index, *section, context)) {
      out.extensions.push_back(*std::move(extension));
    }
  }
  check_list(sections.fixed_list, kFixed, fixed, context.report);
  check_list(sections.extension_list, kExtended, extended, context.report);
  return out;
}

// The objects of a device while modules are being added.
class Extender {
 public:
  Extender(od::DeviceDescription& device, Place place, Context& context)
      : device_(device), place_(place), context_(context) {}

  void add_fixed(const od::ObjectDescription& object) {
    const auto at = find(object.index);
    if (at == device_.objects.end() || at->index != object.index) {
      device_.objects.insert(at, object);
    }
  }

  void add(const SubExtension& extension) {
    Growth& growth = growth_[extension.index];
    unsigned subs = extension.count;
    if (subs == 0) {
      const unsigned width = std::max(od::bit_size(extension.pattern.type), 1U);
      const unsigned before = (growth.bits + width - 1) / width;
      growth.bits += extension.bits;
      subs = (growth.bits + width - 1) / width - before;
    }
    for (; subs != 0; --subs) {
      add_one(extension, growth);
    }
  }

 private:
  // The number of elements that modules have added to an object so far.
  struct Growth {
    unsigned bits = 0;
    unsigned objects = 0;  // full objects before the one that grows
    unsigned sub = 0;      // highest sub-index that a module requested
  };
  using Objects = std::vector<od::ObjectDescription>;

  Objects::iterator find(std::uint16_t index) {
    return std::lower_bound(
        device_.objects.begin(), device_.objects.end(), index,
        [](const od::ObjectDescription& object, std::uint16_t i) { return object.index < i; });
  }

  void add_one(const SubExtension& extension, Growth& growth) {
    const unsigned most =
        extension.extend == 0 ? kMostElements : std::min(extension.extend, kMostElements);
    if (growth.sub == most) {
      ++growth.objects;
      growth.sub = 0;
    }
    ++growth.sub;
    const std::size_t index = extension.index + std::size_t{growth.objects};
    if (index > 0xFFFF) {
      return;
    }
    put(extension, static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(growth.sub));
  }

  void put(const SubExtension& extension, std::uint16_t index, std::uint8_t sub) {
    auto object = find(index);
    if (object == device_.objects.end() || object->index != index) {
      object = device_.objects.insert(object, empty_array(extension, index));
    }
    auto& variables = object->variables;
    const auto at = std::lower_bound(
        variables.begin(), variables.end(), sub,
        [](const od::VariableDescription& v, std::uint8_t s) { return v.sub < s; });
    if (at != variables.end() && at->sub == sub) {
      return;
    }
    if (!charge(context_, extension.pattern, 1, place_)) {
      return;
    }
    od::VariableDescription variable = extension.pattern;
    variable.sub = sub;
    variable.name += std::to_string(sub);
    variables.insert(at, std::move(variable));
    od::VariableDescription& zero = variables.front();
    if (zero.sub == 0 && zero.value.size() == 1 && std::to_integer<unsigned>(zero.value[0]) < sub) {
      zero.value[0] = std::byte{sub};
    }
  }

  static od::ObjectDescription empty_array(const SubExtension& extension, std::uint16_t index) {
    od::ObjectDescription object;
    object.index = index;
    object.name = extension.pattern.name;
    object.type = od::ObjectType::array;
    object.line = extension.pattern.line;
    object.variables.push_back(count_variable(0, object.line));
    return object;
  }

  od::DeviceDescription& device_;
  Place place_;
  Context& context_;
  std::map<std::uint16_t, Growth> growth_;
};

}  // namespace

std::vector<Module> read_modules(const Ini& ini,
                                 const std::map<std::uint16_t, ModuleSections>& sections,
                                 Context& context) {
  std::vector<Module> out;
  for (const auto& [number, module] : sections) {
    out.push_back(read_module(number, module, context));
  }
  if (const Section* section = ini.find("SupportedModules")) {
    const Fields fields(*section, context.report);
    const auto count = fields.number("NrOfEntries", 0xFFFF);
    if (count && *count != out.size()) {
      context.report.warning(fields.find("NrOfEntries")->value_place,
                             "NrOfEntries is " + std::to_string(*count) + ", but " +
                                 std::to_string(out.size()) + " modules are described");
    }
  }
  return out;
}

std::vector<std::uint16_t> read_connected_modules(const Ini& ini, Report& report) {
  std::vector<std::uint16_t> out;
  const Section* section = connected_section(ini);
  if (section == nullptr) {
    return out;
  }
  auto list = read_list(*section, kConnected, report);
  std::stable_sort(list.begin(), list.end(),
                   [](const ListEntry& a, const ListEntry& b) { return a.position < b.position; });
  if (list.size() > kMostElements) {  // the number of sub-indices of 1027h
    report.warning(section->place, "more than 254 modules are connected; the rest is ignored");
    list.resize(kMostElements);
  }
  for (const ListEntry& entry : list) {
    out.push_back(entry.value);
  }
  return out;
}

void connect_modules(const Ini& ini, DataSheet& sheet, Context& context) {
  if (sheet.connected_modules.empty()) {
    return;
  }
  const Place place = connected_section(ini)->place;
  Extender extender(sheet.device, place, context);
  for (const std::uint16_t number : sheet.connected_modules) {
    const auto module = std::find_if(sheet.modules.begin(), sheet.modules.end(),
                                     [number](const Module& m) { return m.number == number; });
    if (module == sheet.modules.end()) {
      context.report.error(place,
                           "module " + std::to_string(number) + " is connected, but not described");
      continue;
    }
    for (const od::ObjectDescription& object : module->fixed_objects) {
      extender.add_fixed(object);
    }
    for (const SubExtension& extension : module->extensions) {
      extender.add(extension);
    }
  }
}

}  // namespace linegate::eds
