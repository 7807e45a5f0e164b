// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "stack/od/description.h"

namespace linegate::manager {

// One SDO download of the configuration step.
struct ObjectWrite {
  od::Address address;
  std::vector<std::byte> data;  // little-endian

  friend bool operator==(const ObjectWrite&, const ObjectWrite&) = default;
};

}  // namespace linegate::manager
