// SPDX-License-Identifier: Apache-2.0
// Counts what operator new gives out, for each thread of a program that links allocations.cpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace linegate::bench {

// Allocations of the calling thread since it began.
std::uint64_t allocations();

// The largest of them in bytes, since the thread began or forget_largest_allocation().
std::size_t largest_allocation();
void forget_largest_allocation();

}  // namespace linegate::bench
