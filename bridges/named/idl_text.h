// SPDX-License-Identifier: Apache-2.0
// The types of named topics as IDL, for the compilers of Fast DDS and Cyclone DDS.
#pragma once

#include <span>
#include <string>

#include "bridges/named/device_types.h"
#include "bridges/named/group_types.h"

namespace linegate::named {

// A document with the types in the given order, those of groups last; without a module if there are
// none. It depends on the types alone.
std::string idl_text(std::span<const DeviceType> types, std::span<const GroupType> groups = {});

}  // namespace linegate::named
