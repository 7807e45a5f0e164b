// SPDX-License-Identifier: Apache-2.0
// Frames that belong to no CANopen service, in the notation of candump and cansend: `linegate send`
// and `linegate listen`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "bridges/console/commands.h"
#include "stack/can/frame.h"
#include "stack/line/command.h"

namespace linegate::console {

// "123#1122.33", "00000123#" (29 bits: eight digits), "123#R", "123#R8", "123##5112233" (CAN FD: a
// digit of flags, of which 1 is the bit rate switch). Returns nothing for other texts.
std::optional<can::Frame> parse_frame(std::string_view text);
// The frame in the same notation.
std::string frame_text(const can::Frame& frame);

// "123", "00000123", "100/700": an identifier and a mask. Empty: all frames. Returns nothing for
// other texts.
std::optional<line::CanListen> parse_identifiers(std::string_view text);

// Sends the frame.
int send(Context& context, const std::string& line, const std::string& text);
// Prints frames that no service of the line uses. count: number of frames; 0: until stopped()
// returns true.
int listen(Context& context, const std::string& line, const std::string& filter,
           std::uint64_t count, const std::function<bool()>& stopped);

}  // namespace linegate::console
