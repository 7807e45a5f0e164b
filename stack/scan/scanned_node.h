// SPDX-License-Identifier: Apache-2.0
// What a scan read of one node, and all of a scan as bytes.
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
  // none: all was read that the device has of what is asked for. Otherwise the node stopped
  // answering (time-out), or the scan was ended, and values are what was read until then.
  AbortCode end = AbortCode::none;
  std::vector<manager::ObjectWrite> values;  // as read, little-endian, ascending by address

  // nullptr if it was not read.
  const std::vector<std::byte>* find(od::Address address) const;
  // Of up to 8 bytes; nothing if it was not read.
  std::optional<std::uint64_t> number(od::Address address) const;
};

// The result of a scan as bytes: the reply to line::CommandKind::scan.
//
//   per node, ascending: U8 node-ID, U32 how it ended (0, or an SDO abort code), U32 size in bytes
//   of what follows, then what was read of it as a concise DCF (stack/manager/plan.h)
//
// little-endian, without gaps. OWN: there is no public format.
std::vector<std::byte> write_report(std::span<const ScannedNode> nodes);
// Fails with length_mismatch if sizes and number of bytes do not agree or a node-ID is none.
Result<std::vector<ScannedNode>> read_report(std::span<const std::byte> data);

}  // namespace linegate::scan
