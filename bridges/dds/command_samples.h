// SPDX-License-Identifier: Apache-2.0
// CommandRequest and CommandReply of the contract from and to the stack's, chunk by chunk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <linegate.h>

#include "stack/line/command.h"

namespace linegate::dds {

// Everything but gateway, line, client, incarnation, id, layout_id and the chunk.
void to_wire(const line::Command& from, v1::CommandRequest& to);

// The members of `from` but its data. `why` is nullptr, or tells in words what is out of range or
// does not go together: then the refusal is bad_request.
const char* from_wire(const v1::CommandRequest& from, line::Command& to);
// Whether the whole data of a command have a length it can have, as above.
const char* check_data(const line::Command& command);

// Puts the chunk of `data` at `offset` (<= data.size()) into a request or a reply.
template <class Sample>
void set_chunk(std::span<const std::byte> data, std::size_t offset, Sample& to);

// The result of a command in words; empty if it was done.
std::string describe_result(Error error);

}  // namespace linegate::dds
