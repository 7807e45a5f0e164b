// SPDX-License-Identifier: Apache-2.0
// The input is a concise DCF (1F22h). Promises: no crash, and an accepted DCF is encoded to the
// same bytes.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/manager/plan.h"

#include "tests/fuzz/expect.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto input = std::as_bytes(std::span(data, size));
  const auto writes = linegate::manager::read_concise_dcf(input);
  if (writes.ok() && !writes->empty()) {
    const auto again = linegate::manager::write_concise_dcf(*writes);
    LINEGATE_EXPECT(std::ranges::equal(again, input));
  }
  return 0;
}
