// SPDX-License-Identifier: Apache-2.0
// Published values that the stack does not have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bridges/named/device_types.h"
#include "gateway/config/plant.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Name and value pairs at the end of states; up to 128, names up to 64 bytes, values up to 256
// (idl/README.md).
struct Property {
  std::string name;
  std::string value;
};

// A counter that never decreases. Names up to 64 bytes.
struct NamedCounter {
  std::string name;
  std::uint64_t value = 0;
};

// Properties of a line that are not in line::LineState.
struct LineInfo {
  std::string name;           // up to 64 bytes
  std::string interface_uri;  // up to 128 bytes
  std::uint32_t bit_rate = 0;
  config::Access access = config::Access::read;
};

// Properties of a node that are not in line::NodeState.
struct NodeInfo {
  std::string name;  // as configured, up to 64 bytes; empty = not configured
  Instant since{};   // when its NMT state or presence last changed
};

// Properties of the gateway that belong to no line.
struct GatewayInfo {
  struct Line {
    std::string name;           // up to 64 bytes
    std::string interface_uri;  // up to 128 bytes
  };
  std::string version;  // up to 64 bytes
  Instant started{};
  std::uint64_t configuration = 0;  // hash of the configuration in force
  Instant configured{};             // when it came into force
  std::uint32_t reloads = 0;
  std::uint32_t reloads_refused = 0;
  std::uint64_t events = 0;        // number of the newest event of the gateway itself
  std::uint64_t event_stream = 0;  // identity of the event numbers, see idl/README.md
  std::size_t participants = 0;
  std::size_t participants_most = 0;
  std::vector<Line> lines;             // up to 1024
  std::vector<NamedCounter> counters;  // up to 63
};

// A sample of a named topic: its values are in the snapshot that it is published with.
struct NamedSample {
  const named::DeviceType& type;
  std::uint64_t number = 0;
  std::span<const Instant> times;  // of the PDOs of the type; Instant{} = never
  // Outputs: of each member of the type, why it is not valid (named::kUnknownWait); else none.
  std::span<const std::uint8_t> waits{};
};

// The parameters of an event as its sample has them, see EventKind in the IDL.
struct EventMembers {
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::vector<std::byte> data;  // up to 16 bytes
};

}  // namespace linegate::gateway
