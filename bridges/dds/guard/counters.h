// What a guard counted.
#pragma once

#include <array>
#include <cstdint>

#include "bridges/dds/guard/reason.h"

namespace linegate::dds::guard {

// They never go back.
struct Counters {
  std::uint64_t received = 0;                     // datagrams, dropped ones included
  std::array<std::uint64_t, kReasons> dropped{};  // datagrams, by Reason

  std::uint64_t of(Reason reason) const { return dropped.at(static_cast<std::size_t>(reason)); }
};

}  // namespace linegate::dds::guard
