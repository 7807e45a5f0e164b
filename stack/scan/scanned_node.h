// SPDX-License-Identifier: Apache-2.0
// The values that a scan read from one node, and the result of a whole scan as bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"
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
};

// The result of a scan as bytes: the reply to line::CommandKind::scan.
//
//   per node, ascending: U8 node-ID, U32 result (0, or an SDO abort code), U32 size in bytes
//   of the rest, then the values as a concise DCF (stack/manager/plan.h)
//
// little-endian, without gaps. OWN: there is no public format.
std::vector<std::byte> write_report(std::span<const ScannedNode> nodes);
// Fails with length_mismatch if the sizes do not agree with the number of bytes, or a node-ID is
// invalid.
Result<std::vector<ScannedNode>> read_report(std::span<const std::byte> data);

}  // namespace linegate::scan
