// SPDX-License-Identifier: Apache-2.0
// The number of bytes of the value of an image entry.
#pragma once

#include <cstdint>

#include "stack/image/layout.h"

namespace linegate::line {

constexpr std::uint32_t byte_length(const image::Entry& entry) {
  return (entry.bit_length + 7U) / 8U;
}

}  // namespace linegate::line
