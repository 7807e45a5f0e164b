// SPDX-License-Identifier: Apache-2.0
// What a scan found as files: a plant.yaml and a DCF for each node.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/od/description.h"
#include "stack/scan/scanned_node.h"

namespace linegate::gateway {

// The line that was scanned, as the written configuration shall have it.
struct ScannedLine {
  std::string gateway;
  std::string name;
  std::string interface_uri;
  std::uint32_t bit_rate = 0;    // bit/s, 0 = not known
  std::uint16_t network_id = 1;  // 1..127
  std::uint8_t node_id = 127;    // own
  std::string access{};          // for commands: off, read or all; empty = not known
  std::string outputs_access{};  // for outputs, likewise
  Duration sync_period{};        // of the SYNC that its own node produces; 0 = none
  unsigned dds_domain = 0;
  std::vector<scan::ScannedNode> nodes;
  // Of the line that runs, by image::Direction; none: not known.
  std::array<std::optional<image::Layout>, 2> layouts{};
};

struct ScanFiles {
  bool ok = false;
  std::vector<std::string> written;  // paths, the configuration first
  // Which EDS was taken for which node, what could not be used, and why the image has another
  // layout than that of the line that runs.
  std::vector<std::string> notes;
  std::string error;  // why not ok
};

// Writes FOLDER/plant.yaml and FOLDER/LINE-NODE.dcf. Nothing is overwritten: a folder that has one
// of them is an error. eds_folder: where files of matching identity are looked for, for names and
// exact types; empty = nowhere.
ScanFiles write_scan(const ScannedLine& line, const std::string& folder,
                     const std::string& eds_folder);

}  // namespace linegate::gateway
