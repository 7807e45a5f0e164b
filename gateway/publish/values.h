// SPDX-License-Identifier: Apache-2.0
// What subscribers receive beyond the stack's own values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gateway/config/plant.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Name and value pairs at the end of states; up to 40, names up to 64 bytes, values up to 256
// (idl/README.md).
struct Property {
  std::string name;
  std::string value;
};

// A number that only grows. Names up to 64 bytes.
struct NamedCounter {
  std::string name;
  std::uint64_t value = 0;
};

// What the gateway knows of a line beyond line::LineState.
struct LineInfo {
  std::string name;           // up to 64 bytes
  std::string interface_uri;  // up to 128 bytes
  std::uint32_t bit_rate = 0;
  config::Access access = config::Access::read;
};

// What the gateway knows of a node beyond line::NodeState.
struct NodeInfo {
  std::string name;  // as configured, up to 64 bytes; empty = not configured
  Instant since{};   // when its NMT state or presence last changed
};

// What belongs to no line.
struct GatewayInfo {
  struct Line {
    std::string name;           // up to 64 bytes
    std::string interface_uri;  // up to 128 bytes
  };
  std::string version;  // up to 64 bytes
  Instant started{};
  std::uint64_t configuration = 0;  // hash of what is in force
  Instant configured{};             // since then
  std::uint32_t reloads = 0;
  std::uint32_t reloads_refused = 0;
  std::uint64_t events = 0;  // number of the newest event of the gateway itself
  std::size_t participants = 0;
  std::size_t participants_most = 0;
  std::vector<Line> lines;             // up to 1024
  std::vector<NamedCounter> counters;  // up to 64
};

}  // namespace linegate::gateway
