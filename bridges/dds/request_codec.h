// SPDX-License-Identifier: Apache-2.0
// The requests of clients from and to the members and data of a CommandRequest: one codec for each
// kind. What they mean is in linegate.idl and COMMANDS.md.
#pragma once

#include <cstddef>
#include <vector>

#include <linegate.h>

#include "bridges/request/request.h"

namespace linegate::dds {

// kind, and the members that it has; the others are 0.
void write_members(const request::Request& from, v1::CommandRequest& to);
std::vector<std::byte> encode_data(const request::Request& from);

// Both give nullptr, or in words what is out of range or does not go together: then the refusal is
// bad_request.
// The kind and the members of `from` but its data.
const char* read_members(const v1::CommandRequest& from, request::Request& to);
// The whole data of a request whose members were read.
const char* decode_data(std::vector<std::byte> data, request::Request& to);

}  // namespace linegate::dds
