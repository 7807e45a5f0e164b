// SPDX-License-Identifier: Apache-2.0
// A line on a classical bus. See line_run.h.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/line_run.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  linegate::fuzz::run_line(linegate::fuzz::Input({data, size}), false);
  return 0;
}
