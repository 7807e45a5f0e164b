// SPDX-License-Identifier: Apache-2.0
// Counters of a guard.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bridges/dds/guard/reason.h"

namespace linegate::dds::guard {

// They never decrease, except `endpoints`.
struct Counters {
  std::size_t endpoints = 0;   // of other participants, discovered and not lost
  std::uint64_t received = 0;  // datagrams, including dropped ones
  // Datagrams by Reason; single GAPs for Reason::gap, TCP connections for stream and reader
  std::array<std::uint64_t, kReasons> dropped{};

  std::uint64_t of(Reason reason) const { return dropped.at(static_cast<std::size_t>(reason)); }
};

}  // namespace linegate::dds::guard
