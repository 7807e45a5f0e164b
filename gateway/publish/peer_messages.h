// SPDX-License-Identifier: Apache-2.0
// The messages between a gateway and the process that sends its requests to other gateways.
//
// Layout: the kind in one octet, and the fields of its struct in their order: numbers
// little-endian, a text with its length in 2 octets, octets with their length in 4.
//
// Messages from the process may contain anything. Each decoder returns nothing unless the message
// is complete, has no octet too many and each of its members is within its limits. A process whose
// message is refused is replaced, so it encodes only what is_valid(): samples may contain anything,
// too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gateway/publish/peer_routes.h"
#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/routing/gateway_request.h"

namespace linegate::gateway {

enum class ToPeers : std::uint8_t {
  configure = 1,  // PeerSettings; the first message
  lines,          // PeerLines
  send,           // PeerSend
  cancel,         // ID in 8 octets
  stop,           // nothing
};

enum class FromPeers : std::uint8_t {
  ready = 1,  // nothing: DDS works
  state,      // PeerState
  gone,       // line
  answer,     // PeerAnswer
  event,      // PeerEventOf
  expiry,     // s since 1970 in 8 octets: the earliest end of a certificate; 0: none
};

// The DDS settings of the client of other gateways.
struct PeerSettings {
  std::string gateway;  // its own name
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces;
  std::vector<std::string> peers;
  std::vector<std::string> servers;
  std::string profile;
  bool guard = true;
  bool secured = false;
  std::string identity;  // folder; if secured
  bool events = false;   // receive the events of the lines
};

struct PeerLines {
  std::vector<routing::GatewayLine> addressed;  // by requests
  std::vector<routing::GatewayLine> emcys;      // whose EMCYs are received
};

struct PeerSend {
  std::uint64_t id = 0;
  routing::GatewayLine to;
  std::uint64_t incarnation = 0;
  Instant deadline{};     // both processes have one monotonic clock
  line::Request request;  // NetworkRead or NetworkWrite
};

struct PeerState {
  routing::GatewayLine line;
  std::uint64_t incarnation = 0;
  std::int64_t time = 0;
  std::uint16_t network = 0;
};

struct PeerEventOf {
  routing::GatewayLine line;
  std::uint64_t incarnation = 0;
  PeerEvent event;
};

struct PeerAnswer {
  std::uint64_t id = 0;
  Error error;
  std::vector<std::byte> data;  // of NetworkRead, cut after kLongestPeerValue octets
};

// One more than the longest value that a line accepts, so that a longer one is not taken for it.
inline constexpr std::size_t kLongestPeerValue = 131'073;

using PeerMessage = std::vector<std::byte>;
using PeerBytes = std::span<const std::byte>;

// 0 if it is empty.
std::uint8_t kind_of(PeerBytes message);

PeerMessage encode(const PeerSettings& settings);
PeerMessage encode(const PeerLines& lines);
PeerMessage encode(const PeerSend& send);
PeerMessage encode_cancel(std::uint64_t id);
PeerMessage encode_stop();

// Whether the decoder accepts it.
bool is_valid(const PeerState& state);
bool is_valid(const PeerEventOf& event);
bool is_valid(const routing::GatewayLine& line);
bool is_valid(const PeerAnswer& answer);

PeerMessage encode_ready();
PeerMessage encode(const PeerState& state);
PeerMessage encode(const PeerEventOf& event);
PeerMessage encode_gone(const routing::GatewayLine& line);
PeerMessage encode(const PeerAnswer& answer);
PeerMessage encode_expiry(std::int64_t time);

std::optional<PeerSettings> decode_settings(PeerBytes message);
std::optional<PeerLines> decode_lines(PeerBytes message);
std::optional<PeerSend> decode_send(PeerBytes message);
std::optional<PeerState> decode_state(PeerBytes message);
std::optional<PeerEventOf> decode_event(PeerBytes message);
std::optional<routing::GatewayLine> decode_gone(PeerBytes message);
std::optional<PeerAnswer> decode_answer(PeerBytes message);
// Of a kind whose content is a number.
std::optional<std::uint64_t> decode_number(PeerBytes message);

}  // namespace linegate::gateway
