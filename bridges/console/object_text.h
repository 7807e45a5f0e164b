// SPDX-License-Identifier: Apache-2.0
// Text forms of objects and numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

#include "stack/od/description.h"

namespace linegate::console {

// At least `digits` hexadecimal digits.
inline std::string format_hex(std::uint64_t number, std::size_t digits) {
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "%0*llX", static_cast<int>(digits),
                static_cast<unsigned long long>(number));
  return text.data();
}

}  // namespace linegate::console
