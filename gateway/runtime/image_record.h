// SPDX-License-Identifier: Apache-2.0
// A snapshot as octets, for another process of the same program on the same host.
#pragma once

#include <cstddef>
#include <span>

#include "gateway/runtime/clock.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// Octets of any snapshot of that layout, whose line has up to `pdos` PDOs in that direction.
std::size_t longest_record(const image::Layout& layout, std::size_t pdos);

// Writes the record; `to` has room for it. Returns its length.
std::size_t write_record(const image::Snapshot& snapshot, const ClockMap& clock,
                         std::span<std::byte> to);
// Returns false if the octets are no record. `sequence` is unchanged.
bool read_record(std::span<const std::byte> from, image::Snapshot& snapshot, ClockMap& clock);

}  // namespace linegate::gateway
