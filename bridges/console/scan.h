// SPDX-License-Identifier: Apache-2.0
// Prints the result of a scan as text and as JSON.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/console/table.h"
#include "stack/scan/scanned_node.h"

namespace linegate::console {

struct ScanResult {
  LineId id;
  LineView line;
  std::vector<scan::ScannedNode> nodes;  // ascending by node-ID
  // Layouts of the line as it ran during the scan, by image::Direction, for ScanRequest::compare.
  std::array<std::optional<image::Layout>, 2> layouts{};
};

struct ScanRequest {
  std::string what;    // a line, or LINE:NODE for one node alone
  bool apply = false;  // set up what is missing, and make the result the configuration of the line
  // Write 1011h first, and make the result the configuration of the line
  bool restore_defaults = false;
  // The result gets layouts. Not with apply, which replaces the line.
  bool compare = false;
};

// Prints progress on context.err and the result at the end; fills `result` if it returns kDone.
// kFailed also if the one requested node is absent; a line may be empty.
int scan(Context& context, const ScanRequest& request, ScanResult& result);

// One row for each node. The notes list problems: identifiers that two devices send, devices
// without error control, analogue inputs that are never sent, nodes that stopped answering.
Table scan_table(const ScanResult& result);
std::string scan_json(const ScanResult& result);

}  // namespace linegate::console
