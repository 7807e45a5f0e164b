// SPDX-License-Identifier: Apache-2.0
// Values of objects, for tests.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/base/byte_order.h"

namespace linegate::manager {

inline std::vector<std::byte> number(std::uint32_t value, std::size_t size = 4) {
  std::vector<std::byte> out(size);
  store_le(std::span(out), value);
  return out;
}

}  // namespace linegate::manager
