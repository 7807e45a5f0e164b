// SPDX-License-Identifier: Apache-2.0
// Counts the allocations by operator new, for each thread of a program that links allocations.cpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace linegate::bench {

// Number of allocations of the calling thread since it started.
std::uint64_t allocations();

// Size in bytes of its largest allocation since it started or called forget_largest_allocation().
std::size_t largest_allocation();
void forget_largest_allocation();

}  // namespace linegate::bench
