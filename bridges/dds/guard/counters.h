// SPDX-License-Identifier: Apache-2.0
// What a guard counted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bridges/dds/guard/reason.h"

namespace linegate::dds::guard {

// They never go back, but for `endpoints`.
struct Counters {
  std::size_t endpoints = 0;                      // of other participants: found and not gone
  std::uint64_t received = 0;                     // datagrams, dropped ones included
  std::array<std::uint64_t, kReasons> dropped{};  // datagrams by Reason, but GAPs for gap

  std::uint64_t of(Reason reason) const { return dropped.at(static_cast<std::size_t>(reason)); }
};

}  // namespace linegate::dds::guard
