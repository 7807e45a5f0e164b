// SPDX-License-Identifier: Apache-2.0
// Joins two output writes of a group that were not applied yet.
#pragma once

#include <cstdint>
#include <span>

#include "stack/line/output_write.h"

namespace linegate::line {

// The bits of an entry in the output area: bit n is bit n % 8 of byte n / 8.
struct OutputPlace {
  std::uint32_t bit_offset = 0;
  std::uint32_t bit_length = 0;
  std::uint16_t pdo = 0;  // the event-driven PDO that carries it; 0 = none
};

// Adds to `newer` the values and bytes of `earlier` that it does not replace: applying `newer` then
// has the effect of applying both in their order. Its runs of bytes become disjoint, so that joined
// writes need no more memory than the area. places: of the entries of the output layout, to which
// both refer; Outputs::check() accepted both. earlier is left without values and bytes.
void add_earlier(OutputWrite& newer, OutputWrite& earlier, std::span<const OutputPlace> places);

}  // namespace linegate::line
