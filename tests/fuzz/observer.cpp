// SPDX-License-Identifier: Apache-2.0
// An observer on a classical bus. See observer_run.h.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/observer_run.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  linegate::fuzz::run_observer(linegate::fuzz::Input({data, size}), false);
  return 0;
}
