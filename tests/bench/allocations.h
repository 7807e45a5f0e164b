// SPDX-License-Identifier: Apache-2.0
// Counts what operator new gives out in this program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace linegate::bench {

// Allocations since the program began.
std::uint64_t allocations();

// The largest of them in bytes, since the program began or forget_largest_allocation().
std::size_t largest_allocation();
void forget_largest_allocation();

}  // namespace linegate::bench
