// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/lists.h"

#include "stack/eds/fields.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {
namespace {

constexpr ListKind kObjects{"SupportedObjects", "index of an object", Severity::error};

void read_entry(const Entry& entry, std::uint64_t position, const ListKind& kind,
                std::vector<ListEntry>& list, Report& report) {
  const std::string_view content = without_comment(entry.value);
  const Number number = parse_number(content);
  std::string problem = number.problem;
  if (number.ok() && (number.negative || number.magnitude == 0 || number.magnitude > 0xFFFF)) {
    problem = quote(content) + " is not in 1h to FFFFh";
  }
  if (problem.empty()) {
    list.push_back({position, static_cast<std::uint16_t>(number.magnitude), entry.value_place});
  } else {
    report.add(kind.severity, entry.value_place, std::string(kind.what) + ": " + problem);
  }
}

}  // namespace

std::vector<ListEntry> read_list(const Section& section, const ListKind& kind, Report& report) {
  std::vector<ListEntry> list;
  std::uint64_t listed = 0;
  for (const Entry& entry : section.entries) {
    if (equal_ignoring_case(entry.key, kind.count_key)) {
      continue;
    }
    if (const Number key = parse_number(entry.key); key.ok()) {
      ++listed;
      read_entry(entry, key.magnitude, kind, list, report);
    } else {
      report.warning(entry.key_place, "key " + quote(entry.key) + " is not a number; ignored");
    }
  }
  const Fields fields(section, report);
  if (const auto count = fields.number(kind.count_key, 0xFFFF); count && *count != listed) {
    report.warning(fields.find(kind.count_key)->value_place,
                   std::string(kind.count_key) + " is " + std::to_string(*count) + ", but " +
                       std::to_string(listed) + " are listed");
  }
  return list;
}

ObjectLists read_object_lists(const Ini& ini, Report& report) {
  ObjectLists lists;
  for (const std::string_view name :
       {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    const Section* section = ini.find(name);
    if (section == nullptr) {
      continue;
    }
    lists.present = true;
    for (const ListEntry& entry : read_list(*section, kObjects, report)) {
      const auto [known, is_new] = lists.indices.try_emplace(entry.value, entry.place);
      if (!is_new) {
        report.warning(entry.place, "object " + hex(entry.value, 4) +
                                        " is already listed in line " +
                                        std::to_string(known->second.line));
      }
    }
  }
  return lists;
}

}  // namespace linegate::eds
