// SPDX-License-Identifier: Apache-2.0
// Values of the DDS contract that the stack does not have.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/clock_map.h"
#include "stack/base/event.h"
#include "stack/base/time.h"
#include "stack/od/data_type.h"

namespace linegate::dds {

// Number of other participants that are accepted at the same time, unless configured otherwise.
inline constexpr std::size_t kMostParticipants = 100;
// Average number of readers, and of writers, of each participant.
inline constexpr std::size_t kMostEndpoints = 128;

// Other participants in the domain: gateways, clients, and any others.
struct DiscoveryCounters {
  std::size_t participants = 0;  // discovered and not lost
  std::size_t most = 0;          // limit: further ones are ignored until one has left
  std::uint64_t discovered = 0;  // since the start
  std::uint64_t gone = 0;        // left, or silent for longer than their lease
};

// The right of a client in a secured domain.
enum class ClientRight : std::uint8_t {
  unlimited,  // without DDS-Security
  none,
  operate,   // outputs, and commands that read or change the process state
  engineer,  // also commands that change configuration, firmware and node-IDs
};

// As in the name of a partition (security.h).
constexpr std::string_view name(ClientRight right) {
  switch (right) {
    case ClientRight::unlimited:
      return "unlimited";
    case ClientRight::none:
      return "none";
    case ClientRight::operate:
      return "operator";
    case ClientRight::engineer:
      return "engineer";
  }
  return "none";
}

// The participant that sent a request. Without DDS-Security any host can forge it.
struct Participant {
  std::array<std::uint8_t, 12> prefix{};  // of the GUID of its writer (RTPS 2.3 9.3.1.1)
  std::string host;                       // as announced, up to 64 bytes; empty: unknown
  ClientRight right = ClientRight::unlimited;
  std::string subject{};  // name of its certificate; empty without DDS-Security
};

// Access of subscribers to a line. The numbers are those of the DDS contract.
enum class Access : std::uint8_t {
  off,   // commands and outputs are refused
  read,  // only commands that change nothing are executed
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

// Properties of a line that are not in line::LineState.
struct LineInfo {
  std::string name;           // up to 64 bytes
  std::string interface_uri;  // up to 128 bytes
  std::uint32_t bit_rate = 0;
  Access access = Access::read;
};

// Properties of a node that are not in line::NodeState.
struct NodeInfo {
  std::string name;  // as configured, up to 64 bytes; empty = not configured
  Instant since{};   // when its NMT state or presence last changed
};

// A counter that never decreases. Names up to 64 bytes.
struct NamedCounter {
  std::string name;
  std::uint64_t value = 0;
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
  std::uint64_t event_stream = 0;  // identity of the event numbers; received: 0 = not known
  std::size_t participants = 0;
  std::size_t participants_most = 0;
  std::vector<Line> lines;             // up to 1024
  std::vector<NamedCounter> counters;  // up to 63; of more, the sample has the number missing
};

// Name and value pairs at the end of LineState, NodeState and Event; up to kMaxProperties, names up
// to 64 bytes, values up to 256. Of more properties, the sample has the number that is missing.
struct Property {
  std::string name;
  std::string value;
};

// The members of an Event whose meaning depends on its kind, see event_codec.h.
struct EventFields {
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::uint8_t length = 0;           // number of bytes used in data
  std::array<std::byte, 64> data{};  // events of this version have up to 16

  std::span<const std::byte> bytes() const { return std::span(data).first(length); }

  friend bool operator==(const EventFields&, const EventFields&) = default;
};

// An event as a subscriber receives it, from a gateway of this or another version.
struct ReceivedEvent {
  std::uint64_t number = 0;
  std::uint64_t stream = 0;  // of the number; 0: the gateway does not state it
  Instant time{};
  EventKind kind{};  // kinds that are unknown to this version keep their number
  EventSeverity severity{};
  std::uint8_t node = 0;
  EventFields fields{};
  std::optional<EventData> data{};  // nothing: the kind is unknown

  // As Event::get().
  template <class Data>
  const Data* get() const {
    return data ? std::get_if<Data>(&*data) : nullptr;
  }
};

// The other gateways whose participants are discovered, and for how long this list is unchanged.
struct Peers {
  std::vector<std::string> gateways;  // names, sorted, each once
  Duration unchanged{};
};

// One value of a PDO.
struct PdoValue {
  std::uint32_t entry = 0;  // of the input layout
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  od::DataType type = od::DataType::none;
  std::uint16_t bit_length = 0;
  std::vector<std::byte> data;  // little-endian, at the low end
};

// The values that arrived together in one PDO.
struct PdoUpdate {
  std::uint8_t node = 0;
  std::uint16_t pdo = 0;  // the node's TPDO number
  Instant time{};
  std::uint32_t receptions = 0;
  std::vector<PdoValue> values;
};

// One reception of a queued PDO.
struct PdoReception {
  std::uint8_t node = 0;
  std::uint16_t pdo = 0;  // the node's TPDO number
  Instant time{};
  std::uint64_t number = 0;  // 1, 2, 3, ..., counted per line
  std::uint32_t lost = 0;    // number of receptions that its queue dropped since the previous one
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
inline constexpr std::size_t kMaxProperties = 128;
inline constexpr std::size_t kChunkBytes = 8'192;
inline constexpr std::size_t kChunksPerReply = 8;

}  // namespace linegate::dds
