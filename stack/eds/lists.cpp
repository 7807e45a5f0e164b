#include "stack/eds/lists.h"

#include "stack/eds/fields.h"
#include "stack/eds/number.h"
#include "stack/eds/text.h"

namespace linegate::eds {
namespace {

constexpr std::string_view kCount = "SupportedObjects";

void read_entry(const Entry& entry, ObjectLists& lists, Report& report) {
  const std::string_view content = without_comment(entry.value);
  const Number index = parse_number(content);
  if (!index.ok()) {
    report.error(entry.value_place, "index of an object: " + index.problem);
  } else if (index.negative || index.magnitude == 0 || index.magnitude > 0xFFFF) {
    report.error(entry.value_place,
                 "index of an object: " + quote(content) + " is not in 1h to FFFFh");
  } else {
    const auto [known, is_new] =
        lists.indices.try_emplace(static_cast<std::uint16_t>(index.magnitude), entry.value_place);
    if (!is_new) {
      report.warning(entry.value_place, "object " + hex(index.magnitude, 4) +
                                            " is already listed in line " +
                                            std::to_string(known->second.line));
    }
  }
}

void read_list(const Section& section, ObjectLists& lists, Report& report) {
  std::uint64_t listed = 0;
  for (const Entry& entry : section.entries) {
    if (equal_ignoring_case(entry.key, kCount)) {
      continue;
    }
    if (parse_number(entry.key).ok()) {
      ++listed;
      read_entry(entry, lists, report);
    } else {
      report.warning(entry.key_place, "key " + quote(entry.key) + " is not a number; ignored");
    }
  }
  const Fields fields(section, report);
  if (const auto count = fields.number(kCount, 0xFFFF); count && *count != listed) {
    report.warning(fields.find(kCount)->value_place, "SupportedObjects is " +
                                                         std::to_string(*count) + ", but " +
                                                         std::to_string(listed) + " are listed");
  }
}

}  // namespace

ObjectLists read_object_lists(const Ini& ini, Report& report) {
  ObjectLists lists;
  for (const std::string_view name :
       {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    if (const Section* section = ini.find(name)) {
      lists.present = true;
      read_list(*section, lists, report);
    }
  }
  return lists;
}

}  // namespace linegate::eds
