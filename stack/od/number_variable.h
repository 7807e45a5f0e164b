// SPDX-License-Identifier: Apache-2.0
// How an object of our own is described, where no file does.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::od {

// A sub-index with a number of that type as its default. Precondition: the type has a fixed size,
// of 8 bytes at most; or it has none, as DOMAIN, and the value is 0.
inline VariableDescription number_variable(std::uint8_t sub, std::string name, DataType type,
                                           Access access, std::uint64_t value = 0) {
  LINEGATE_ASSERT(byte_size(type) <= sizeof value && (byte_size(type) > 0 || value == 0),
                  "the type has room for the number");
  VariableDescription out;
  out.sub = sub;
  out.name = std::move(name);
  out.type = type;
  out.access = access;
  out.value.resize(byte_size(type));
  store_le(std::span<std::byte>(out.value), value);
  return out;
}

// A VAR with the name and the type that the catalogue has (objects.h). Precondition: it has the
// index, as a VAR with a number.
ObjectDescription catalogued_variable(std::uint16_t index, Access access, std::uint64_t value = 0);

// 1018h with its four sub-indices (CiA 301, 7.5.2.21).
ObjectDescription identity_object(std::uint32_t vendor = 0, std::uint32_t product = 0,
                                  std::uint32_t revision = 0, std::uint32_t serial = 0);

}  // namespace linegate::od
