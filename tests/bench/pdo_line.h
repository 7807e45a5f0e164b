// SPDX-License-Identifier: Apache-2.0
// A line with devices that send PDOs of 8 bytes, and the frames of these PDOs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stack/can/frame.h"
#include "stack/line/config.h"

namespace linegate::bench {

enum class Mapping {
  event_driven,  // 4 x UNSIGNED16
  synchronous,   // the same, transmission type 1
  bits,          // 64 x BOOLEAN
};

// `count` identifiers below 580h that are available for PDOs, in a seeded random order.
std::vector<std::uint32_t> pdo_identifiers(std::size_t count);

// A manager with one node for every 8 identifiers. Each PDO has a deadline.
line::LineConfig pdo_line(Mapping mapping, std::span<const std::uint32_t> ids);

enum class Order {
  random,  // any PDO may follow any other, or itself
  cycles,  // each cycle has every PDO once, each time in another order
};

// Frames of these PDOs in a seeded order. In each frame, four bytes differ from the previous frame
// of the same PDO.
std::vector<can::Frame> pdo_frames(std::span<const std::uint32_t> ids, std::size_t count,
                                   Order order = Order::random);

}  // namespace linegate::bench
