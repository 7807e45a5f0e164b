// SPDX-License-Identifier: Apache-2.0
// A request by the members of CommandRequest, for clients that know the contract and not the types
// of the stack.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bridges/request/request.h"

namespace linegate::dds {

// As the members of the same names of CommandRequest in linegate.idl.
struct RawRequest {
  std::uint8_t kind = 0;
  std::uint8_t node = 0;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint8_t nmt = 0;
  std::uint16_t code = 0;
  std::uint8_t error_register = 0;
  std::uint32_t entry = 0;
  std::vector<std::byte> data{};
};

// Returns an empty text, or what is out of range or does not go together.
std::string to_request(const RawRequest& from, request::Request& to);
// The reverse.
RawRequest to_raw(const request::Request& from);

}  // namespace linegate::dds
