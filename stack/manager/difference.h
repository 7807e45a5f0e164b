// SPDX-License-Identifier: Apache-2.0
// An object of a node that does not have the value that it is to have.
#pragma once

#include <vector>

#include "stack/base/abort_code.h"
#include "stack/od/description.h"

namespace linegate::manager {

struct Difference {
  od::Address object;
  std::vector<std::byte> expected;    // little-endian
  AbortCode abort = AbortCode::none;  // why it cannot be written or read; none: it is `found`
  std::vector<std::byte> found{};

  friend bool operator==(const Difference&, const Difference&) = default;
};

}  // namespace linegate::manager
