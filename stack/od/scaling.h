// SPDX-License-Identifier: Apache-2.0
// How a value is shown to people.
#pragma once

#include <cstddef>
#include <string>

namespace linegate::od {

inline constexpr std::size_t kLongestUnit = 32;  // bytes of Scaling::unit

// value = raw * scale + offset, in `unit`.
struct Scaling {
  std::string unit;    // "bar"; empty = none. Also of a value that is not scaled
  double scale = 1.0;  // finite, not 0
  double offset = 0.0;

  bool is_scaled() const { return !(scale == 1.0 && offset == 0.0); }
  friend bool operator==(const Scaling&, const Scaling&) = default;
};

}  // namespace linegate::od
