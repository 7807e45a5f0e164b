// SPDX-License-Identifier: Apache-2.0
// The result of a scan as bytes: the reply to line::CommandKind::scan.
//
//   per node, ascending: U8 node-ID, U32 how it ended (0, or an SDO abort code), U32 size in bytes
//   of what follows, then what was read of it as a concise DCF (stack/manager/concise_dcf.h)
//
// little-endian, without gaps. OWN: there is no public format.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "stack/base/result.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

std::vector<std::byte> write_report(std::span<const ScannedNode> nodes);
// Fails with length_mismatch if sizes and number of bytes do not agree or a node-ID is none.
Result<std::vector<ScannedNode>> read_report(std::span<const std::byte> data);

}  // namespace linegate::scan
