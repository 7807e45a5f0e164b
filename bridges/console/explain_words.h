// SPDX-License-Identifier: Apache-2.0
// Codes of CiA 301 and CiA 305 in words.
#pragma once

#include <cstdint>
#include <string>

#include "stack/can/frame.h"

namespace linegate::console {

// Emergency error code (CiA 301 7.2.7.1, table of error code classes): "heartbeat or life guarding
// error". Never empty.
std::string describe_error_code(std::uint16_t code);
// The bits of 1001h: "generic, communication". Empty for 0.
std::string describe_error_register(std::uint8_t bits);

// A frame on 7E5h (request) or 7E4h (CiA 305).
std::string explain_lss(const can::Frame& frame, bool request);

}  // namespace linegate::console
