// SPDX-License-Identifier: Apache-2.0
// Writes the result of a scan to files: a plant.yaml and a DCF for each node.
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
#include "stack/usdo/abort_form.h"

namespace linegate::gateway {

// The scanned line, with the settings for the written configuration.
struct ScannedLine {
  std::string gateway;
  std::string name;
  std::string interface_uri;
  std::uint32_t bit_rate = 0;    // bit/s, 0 = not known
  std::uint16_t network_id = 1;  // 1..127
  std::uint8_t node_id = 127;    // node-ID of the line itself
  std::string access{};          // for commands: off, read or all; empty = not known
  std::string outputs_access{};  // for outputs, likewise
  Duration sync_period{};        // of the SYNC that the line produces; 0 = none
  unsigned dds_domain = 0;
  bool canopen_fd = false;
  std::uint32_t data_bit_rate = 0;  // bit/s, 0 = not known
  usdo::AbortForm usdo_abort = usdo::AbortForm::one_byte;
  // Of a flying master: its priority, 0..2
  std::optional<std::uint8_t> flying_master{};
  std::vector<scan::ScannedNode> nodes;
  // The layouts of the running line, by image::Direction; empty: not known.
  std::array<std::optional<image::Layout>, 2> layouts{};
};

struct ScanFiles {
  bool ok = false;
  std::vector<std::string> written;  // paths, the configuration first
  // The EDS selected for each node, data that could not be used, and why the layout of the image
  // differs from that of the running line.
  std::vector<std::string> notes;
  std::string error;  // description of the error, if not ok
};

// Writes FOLDER/plant.yaml and FOLDER/LINE-NODE.dcf. Never overwrites a file: an existing one is an
// error. eds_folder: folder of EDS files with matching identities, for names and exact types; empty
// = none.
ScanFiles write_scan(const ScannedLine& line, const std::string& folder,
                     const std::string& eds_folder);

}  // namespace linegate::gateway
