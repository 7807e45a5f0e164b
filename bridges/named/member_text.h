// SPDX-License-Identifier: Apache-2.0
// A member of a type in words, for the comments of generated documents. Internal to this folder.
#pragma once

#include <cstdint>
#include <string>

#include "bridges/named/device_types.h"

namespace linegate::named {

// "6004:00 UNSIGNED32, PDO 1: Position value; raw * 0.1, in mm". One line of printable ASCII.
std::string comment_of(const Member& member);

// The member with the time of a PDO: "pdo1", or "srdo1" of an SRDO.
std::string time_member(std::uint16_t pdo);

}  // namespace linegate::named
