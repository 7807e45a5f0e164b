// SPDX-License-Identifier: Apache-2.0
// What the DDS contract carries beyond the stack's own values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/clock_map.h"
#include "stack/base/time.h"
#include "stack/od/data_type.h"

namespace linegate::dds {

// Other participants that are taken note of at the same time, unless something else is configured.
inline constexpr std::size_t kMostParticipants = 100;
// Readers, and writers, of each of them on average.
inline constexpr std::size_t kMostEndpoints = 128;

// Other participants of the domain: gateways, clients, strangers.
struct DiscoveryCounters {
  std::size_t participants = 0;  // now
  std::size_t most = 0;          // further ones are ignored until one of these has gone
  std::uint64_t discovered = 0;  // since the start
  std::uint64_t gone = 0;        // left, or not heard within their lease
};

// What subscribers may do to a line. The numbers are those of the DDS contract.
enum class Access : std::uint8_t {
  off,   // commands and outputs are refused
  read,  // commands that change nothing are carried out
  all,
};

constexpr std::string_view name(Access access) {
  switch (access) {
    case Access::off:
      return "off";
    case Access::read:
      return "read";
    case Access::all:
      return "all";
  }
  return "unknown";
}

// What the gateway knows of a line and the line itself does not.
struct LineInfo {
  std::string name;           // up to 64 bytes
  std::string interface_uri;  // up to 128 bytes
  std::uint32_t bit_rate = 0;
  Access access = Access::read;
};

// What the gateway knows of a node beyond line::NodeState.
struct NodeInfo {
  std::string name;  // as configured, up to 64 bytes; empty = not configured
  Instant since{};   // when its NMT state or presence last changed
};

// A number that only grows. Names up to 64 bytes.
struct NamedCounter {
  std::string name;
  std::uint64_t value = 0;
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

// Name and value pairs at the end of LineState, NodeState and Event; up to 40, names up to 64
// bytes, values up to 256.
struct Property {
  std::string name;
  std::string value;
};

// The other gateways whose participants are discovered, and how long none has come or gone.
struct Peers {
  std::vector<std::string> gateways;  // names, sorted, each once
  Duration unchanged{};
};

// One value out of a PDO.
struct PdoValue {
  std::uint32_t entry = 0;  // of the input layout
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  od::DataType type = od::DataType::none;
  std::uint16_t bit_length = 0;
  std::vector<std::byte> data;  // little-endian, bits in the low end
};

// The values that arrived together in one PDO.
struct PdoUpdate {
  std::uint8_t node = 0;
  std::uint16_t pdo = 0;  // the node's TPDO number
  Instant time{};
  std::uint32_t receptions = 0;
  std::vector<PdoValue> values;
};

// One reception of a PDO that is queued.
struct PdoReception {
  std::uint8_t node = 0;
  std::uint16_t pdo = 0;  // the node's TPDO number
  Instant time{};
  std::uint64_t number = 0;  // 1, 2, 3, ... of the line
  std::uint32_t lost = 0;    // dropped by its queue since the one before
  std::vector<PdoValue> values;
};

// Limits of the contract, in elements of its bounded sequences.
inline constexpr std::size_t kMaxLayoutPart = 256;
inline constexpr std::size_t kMaxEntries = 65'536;
inline constexpr std::size_t kMaxStamps = 4'096;
inline constexpr std::size_t kMaxPdoValues = 64;
inline constexpr std::size_t kMaxOutputValues = 4'096;
inline constexpr std::size_t kMaxOutputRuns = 256;
inline constexpr std::size_t kMaxGatewayLines = 1'024;
inline constexpr std::size_t kMaxCounters = 64;
inline constexpr std::size_t kMaxProperties = 40;
inline constexpr std::size_t kChunkBytes = 8'192;
inline constexpr std::size_t kChunksPerReply = 8;

}  // namespace linegate::dds
