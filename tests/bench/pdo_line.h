// SPDX-License-Identifier: Apache-2.0
// A line with devices that send PDOs of 8 bytes, and the frames they send.
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

// Identifiers below 580h that are free for PDOs, in a seeded random order.
std::vector<std::uint32_t> pdo_identifiers(std::size_t count);

// A manager with one node for every 8 of the identifiers. Each PDO has a deadline.
line::LineConfig pdo_line(Mapping mapping, std::span<const std::uint32_t> ids);

enum class Order {
  random,  // any PDO may follow any, itself too
  cycles,  // of as many frames as there are PDOs: in each cycle every PDO once, in another order
};

// Frames of these PDOs in a seeded order. Each has four of its bytes other than the frame of the
// same PDO before.
std::vector<can::Frame> pdo_frames(std::span<const std::uint32_t> ids, std::size_t count,
                                   Order order = Order::random);

}  // namespace linegate::bench
