// SPDX-License-Identifier: Apache-2.0
// Converts between CommandRequest and CommandReply of the contract and the stack's values, chunk by
// chunk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <linegate.h>

#include "bridges/request/request.h"

namespace linegate::dds {

// Everything except gateway, line, client, incarnation, id, layout_id and the chunk of the data;
// for the data see encode_data().
void to_wire(const request::Request& from, Duration timeout, v1::CommandRequest& to);

// Copies the members of `from` except its data, see decode_data(). Returns nullptr, or, for
// Refusal::bad_request, a description of the member that is out of range or the members that
// contradict each other.
const char* from_wire(const v1::CommandRequest& from, request::Request& to, Duration& timeout);

// Puts the chunk of `data` at `offset` (<= data.size()) into a request or a reply.
template <class Sample>
void set_chunk(std::span<const std::byte> data, std::size_t offset, Sample& to);

// Describes the result of a command; empty if it was done. data: of the reply.
std::string describe_result(Error error, std::span<const std::byte> data = {});

}  // namespace linegate::dds
