// SPDX-License-Identifier: Apache-2.0
// How an object of our own is described, where no file does.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::od {

// A sub-index with a number of that type as its default. Precondition: the type has a fixed size,
// of 8 bytes at most.
inline VariableDescription number_variable(std::uint8_t sub, std::string name, DataType type,
                                           Access access, std::uint64_t value = 0) {
  VariableDescription out;
  out.sub = sub;
  out.name = std::move(name);
  out.type = type;
  out.access = access;
  out.value.resize(byte_size(type));
  store_le(std::span<std::byte>(out.value), value);
  return out;
}

}  // namespace linegate::od
