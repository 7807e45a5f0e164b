// SPDX-License-Identifier: Apache-2.0
// One reception of an RPDO with a queue, as a plain value that may be passed to other threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::pdo {

struct Reception {
  std::uint64_t layout_id = 0;    // layout of the inputs at the reception
  Instant time{};                 // receive time of the frame
  std::uint32_t first_entry = 0;  // its entries are first_entry .. first_entry + entries - 1
  std::uint16_t entries = 0;
  std::uint16_t local_pdo = 0;
  std::uint16_t remote_pdo = 0;
  std::uint8_t node = 0;
  // Receptions of this PDO that its queue dropped since the previous one: each was the oldest when
  // the queue was full.
  std::uint32_t lost = 0;
  // The values of the entries in their order, packed without the gaps of the frame: the lowest bit
  // of the second follows the highest of the first.
  std::array<std::byte, can::kMaxFdData> values{};
};

}  // namespace linegate::pdo
