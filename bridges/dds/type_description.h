// SPDX-License-Identifier: Apache-2.0
// Describes the type of a named topic in the announcements of its writers (TypeObject, DDS-XTypes
// 1.2 7.3.4), for generic tools.
#pragma once

#include <string>
#include <vector>

#include "bridges/named/described_type.h"

namespace linegate::dds {

// Makes the description known to the library, which announces it with types of that name that
// fill in their type object. It remains for the life of the process. Returns false if the library
// refuses it.
bool describe_type(const std::string& name, const std::vector<named::DescribedMember>& members);

}  // namespace linegate::dds
