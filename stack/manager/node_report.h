// SPDX-License-Identifier: Apache-2.0
// The result of a verification or of an application of the configuration of a node.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/state.h"
#include "stack/od/description.h"

namespace linegate::manager {

// An object of a node that differs from its expected value.
struct Difference {
  od::Address object;
  std::vector<std::byte> expected;  // little-endian
  // Why it cannot be written or read; none: its value is `found`
  AbortCode abort = AbortCode::none;
  std::vector<std::byte> found{};

  friend bool operator==(const Difference&, const Difference&) = default;
};

struct NodeReport {
  std::uint8_t node = 0;
  // After an application: error status of the boot slave process. After a verification: kBooted.
  char boot = kBooted;
  // After a verification: why not every object was read. After an application: the abort code that
  // ended it, of the object in `differences` if there is one.
  AbortCode end = AbortCode::none;
  std::vector<Difference> differences;

  bool good() const { return boot == kBooted && end == AbortCode::none && differences.empty(); }
  friend bool operator==(const NodeReport&, const NodeReport&) = default;
};

}  // namespace linegate::manager
