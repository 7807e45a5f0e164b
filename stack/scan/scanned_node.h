// SPDX-License-Identifier: Apache-2.0
// The values that a scan read from one node.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/plan.h"
#include "stack/od/description.h"

namespace linegate::scan {

struct ScannedNode {
  std::uint8_t id = 0;
  // none: every requested object that the device has was read. Otherwise the node stopped answering
  // (time-out) or the scan was cancelled, and `values` holds the objects read until then.
  AbortCode end = AbortCode::none;
  std::vector<manager::ObjectWrite> values;  // as read, little-endian, ascending by address

  // nullptr if it was not read.
  const std::vector<std::byte>* find(od::Address address) const;
  // The value, little-endian, if it has up to 8 bytes; nothing if it was not read.
  std::optional<std::uint64_t> number(od::Address address) const;

  friend bool operator==(const ScannedNode&, const ScannedNode&) = default;
};

}  // namespace linegate::scan
