// The lists [MandatoryObjects], [OptionalObjects] and [ManufacturerObjects]; private to stack/eds.
#pragma once

#include <cstdint>
#include <map>

#include "stack/eds/ini.h"

namespace linegate::eds {

struct ObjectLists {
  bool present = false;                    // at least one of them
  std::map<std::uint16_t, Place> indices;  // and where each is listed
};

// An entry that is not an index is an error: nobody can say which object is missing.
ObjectLists read_object_lists(const Ini& ini, Report& report);

}  // namespace linegate::eds
