// SPDX-License-Identifier: Apache-2.0
// What a scan read of one node.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/plan.h"
#include "stack/od/description.h"

namespace linegate::scan {

struct ScannedNode {
  std::uint8_t id = 0;
  // none: all was read that the device has of what is asked for. Otherwise the node stopped
  // answering (time-out), or the scan was ended, and values are what was read until then.
  AbortCode end = AbortCode::none;
  std::vector<manager::ObjectWrite> values;  // as read, little-endian, ascending by address

  // nullptr if it was not read.
  const std::vector<std::byte>* find(od::Address address) const;
  // Of up to 8 bytes; nothing if it was not read.
  std::optional<std::uint64_t> number(od::Address address) const;
};

}  // namespace linegate::scan
