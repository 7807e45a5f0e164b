// SPDX-License-Identifier: Apache-2.0
// How many bytes the value of an entry of the image has.
#pragma once

#include <cstdint>

#include "stack/image/layout.h"

namespace linegate::line {

constexpr std::uint32_t byte_length(const image::Entry& entry) {
  return (entry.bit_length + 7U) / 8U;
}

}  // namespace linegate::line
