// SPDX-License-Identifier: Apache-2.0
// The nodes that a scan found, as the configuration of their line has them: whether that is written
// to files or taken over by the line that runs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "stack/line/config.h"
#include "stack/scan/scanned_node.h"

namespace linegate::config {

struct FoundNode {
  // Called as its product, with the node-ID (Encoder-5), or nodeN. Nothing is to be written to it
  // but: heartbeat or guarding as they are, 6423h if it is true, and what differs from its device
  // file.
  line::NodeConfig config;
  std::string sheet;  // the EDS it was made with, empty = none
};

struct FoundNodes {
  std::vector<FoundNode> nodes;  // ascending by id; those that were read to the end
  // Which EDS was taken for which node, and what is left out.
  std::vector<std::string> notes;
  std::string error;  // eds_folder or a file of it cannot be read; empty = all is well
};

// eds_folder: where files of matching identity are looked for, for names and exact types; empty =
// nowhere. PDOs that a manager takes no part in (scan/conflicts.h) do not exist in what is made.
// longest_pdo: in bits, see line::longest_pdo().
FoundNodes found_nodes(std::span<const scan::ScannedNode> nodes, const std::string& eds_folder,
                       std::size_t longest_pdo);

}  // namespace linegate::config
