// SPDX-License-Identifier: Apache-2.0
// What one direction of a process image can have, beside image::kMaxAreaBytes. A configuration that
// needs more is refused when it is read, so no subscriber receives a part of an image.
#pragma once

#include <cstddef>

namespace linegate::image {

inline constexpr std::size_t kMaxEntries = 65'536;
inline constexpr std::size_t kMaxPdos = 4'096;
inline constexpr std::size_t kLongestEntryName = 128;  // bytes of Entry::name

}  // namespace linegate::image
