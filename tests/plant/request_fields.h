// SPDX-License-Identifier: Apache-2.0
// What several kinds of requests have in common.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include "stack/base/byte_order.h"
#include "stack/can/frame.h"
#include "stack/line/command.h"

namespace linegate::plant {

// nullptr: it is of another kind.
template <class Request>
const Request* as(const line::Command& command) {
  return std::get_if<Request>(&command.request);
}

// 0000h:00 if it names no object.
inline od::Address address_of(const line::Command& command) {
  return std::visit(
      [](const auto& request) {
        if constexpr (requires { request.address; }) {
          return request.address;
        } else {
          return od::Address{};
        }
      },
      command.request);
}

// Whether the frame has the code and the information of the command. fd: the line sends EMCYs of
// CANopen FD.
inline bool is_emcy_of(const can::Frame& frame, bool fd, const line::EmcySend& command) {
  const std::size_t info = fd ? 14 : 3;  // the first manufacturer byte
  return frame.fd() == fd && load_le<std::uint16_t>(frame.data.data()) == command.code &&
         std::ranges::equal(command.manufacturer, std::span(frame.data).subspan(info, 5));
}

// Empty if it writes nothing.
inline std::span<const std::byte> data_of(const line::Command& command) {
  return std::visit(
      [](const auto& request) -> std::span<const std::byte> {
        if constexpr (requires { request.data; }) {
          return request.data;
        } else {
          return {};
        }
      },
      command.request);
}

}  // namespace linegate::plant
