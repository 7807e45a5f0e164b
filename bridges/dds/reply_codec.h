// SPDX-License-Identifier: Apache-2.0
// Converts the data of the replies of a line from and to the data of a CommandReply: one codec for
// each type of result. The bytes are documented in idl/COMMANDS.md.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "bridges/request/request.h"
#include "stack/base/result.h"
#include "stack/line/replies.h"

namespace linegate::dds {

std::vector<std::byte> encode_reply(const line::ReplyData& data);
// error: of the same reply. Returns nothing if the bytes do not match the request.
std::optional<line::ReplyData> decode_reply(const request::Request& request, Error error,
                                            std::span<const std::byte> bytes);

}  // namespace linegate::dds
