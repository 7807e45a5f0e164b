// SPDX-License-Identifier: Apache-2.0
// What several kinds of requests have in common.
#pragma once

#include <cstddef>
#include <span>
#include <variant>

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
