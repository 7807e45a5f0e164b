// SPDX-License-Identifier: Apache-2.0
// What a scan found, for people and programs.
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
  // Of the line as it ran during the scan, by image::Direction, for ScanRequest::compare.
  std::array<std::optional<image::Layout>, 2> layouts{};
};

struct ScanRequest {
  std::string what;               // a line, or LINE:NODE for one node alone
  bool apply = false;             // what is missing is set up, and the line takes the result over
  bool restore_defaults = false;  // 1011h first; the line takes the result over
  // The result has layouts. Not of a line that takes it over, which is made anew.
  bool compare = false;
};

// Tells on context.err which nodes have been read meanwhile, and prints what was found. `result`
// has it too when kDone comes back. kFailed also if the one node that was asked for is not there; a
// line may be without any.
int scan(Context& context, const ScanRequest& request, ScanResult& result);

// A row for each node; the notes say what will not work as it is: identifiers that two devices send
// on, devices without error control, analogue inputs that are never sent, nodes that fell silent.
Table scan_table(const ScanResult& result);
std::string scan_json(const ScanResult& result);

}  // namespace linegate::console
