// SPDX-License-Identifier: Apache-2.0
// A consistent copy of one direction of a line's process image: a plain value that may be passed to
// other threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/layout.h"

namespace linegate::image {

// Receptions (inputs) or transmissions (outputs) of one PDO since the last snapshot.
struct PdoMark {
  std::uint16_t local_pdo = 0;
  std::uint16_t remote_pdo = 0;
  std::uint8_t node = 0;
  std::uint32_t count = 0;        // frames since the last snapshot
  Instant time{};                 // receive (send) time of the last frame
  std::uint32_t first_entry = 0;  // its entries are first_entry .. first_entry + entries - 1
  std::uint32_t entries = 0;
};

// Buffers grow when the layout is compiled and are reused: taking a snapshot does not allocate.
struct Snapshot {
  Direction direction = Direction::inputs;
  std::uint64_t layout_id = 0;
  std::uint64_t sequence = 0;    // 1, 2, ... per line and direction, counted when taken
  std::uint64_t generation = 0;  // used by the image to find the stale blocks of this copy
  Instant acquired{};            // time of the snapshot
  std::uint32_t sync_count = 0;  // number of SYNCs on the line
  std::vector<std::byte> bytes;
  std::vector<std::uint64_t>
      changed;  // bit i: entry i changed (was written) since the previous snapshot
  // bit i: entry i has a value received from a live node (inputs), or its newest value was
  // transmitted since its node was started (outputs)
  std::vector<std::uint64_t> valid;
  // Outputs, bit i: entry i was written or has a default; its PDO is held back until all its
  // entries are known. For an observer the same as valid.
  std::vector<std::uint64_t> known;
  std::vector<PdoMark> marks;  // only PDOs with count > 0, at most one per PDO

  bool is_changed(std::size_t entry) const {
    return (changed[entry / 64] >> (entry % 64) & 1U) != 0;
  }
  bool is_valid(std::size_t entry) const { return (valid[entry / 64] >> (entry % 64) & 1U) != 0; }
  bool is_known(std::size_t entry) const { return (known[entry / 64] >> (entry % 64) & 1U) != 0; }
};

}  // namespace linegate::image
