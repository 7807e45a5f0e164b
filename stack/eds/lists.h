// SPDX-License-Identifier: Apache-2.0
// Lists of numbers, "1=0x1000", "2=0x1001" and so on: objects, modules; private to stack/eds.
#pragma once

#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "stack/eds/ini.h"

namespace linegate::eds {

struct ListEntry {
  std::uint64_t position = 0;  // the key
  std::uint16_t value = 0;
  Place place;
};

// The name of a list and its description in messages.
struct ListKind {
  std::string_view count_key;  // "SupportedObjects"
  std::string_view what;       // "index of an object"
  Severity severity;           // for an invalid entry
};

// In the order of the file. Reports entries outside 1h to FFFFh, and a wrong count.
std::vector<ListEntry> read_list(const Section& section, const ListKind& kind, Report& report);

struct ObjectLists {
  bool present = false;                    // at least one of the lists exists
  std::map<std::uint16_t, Place> indices;  // with the place of each in its list
};

// [MandatoryObjects], [OptionalObjects] and [ManufacturerObjects]. An entry that is not an index is
// an error, because the missing object is unknown.
ObjectLists read_object_lists(const Ini& ini, Report& report);

}  // namespace linegate::eds
