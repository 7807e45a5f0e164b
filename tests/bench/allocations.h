// Counts what operator new gives out in this program.
#pragma once

#include <cstdint>

namespace linegate::bench {

// Allocations since the program began.
std::uint64_t allocations();

}  // namespace linegate::bench
