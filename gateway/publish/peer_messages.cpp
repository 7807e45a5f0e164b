// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_messages.h"

#include <algorithm>
#include <utility>

#include "bridges/request/field_bytes.h"
#include "stack/can/cob_id.h"

namespace linegate::gateway {
namespace {

using request::FieldReader;
using request::FieldWriter;
using routing::GatewayLine;

constexpr std::size_t kLongestLineName = 64;
constexpr std::size_t kMostPeerLines = 4'096;
constexpr std::uint8_t kMostPeerHops = 0xFE;  // one more fits

template <class Kind>
FieldWriter message_of(Kind kind) {
  FieldWriter out;
  out.number(static_cast<std::uint64_t>(kind), 1);
  return out;
}

FieldReader content_of(PeerBytes message) {
  return FieldReader(message.empty() ? message : message.subspan(1));
}

void write(FieldWriter& out, const GatewayLine& line) {
  out.sized(line.gateway, 2);
  out.sized(line.line, 2);
}

GatewayLine read_line(FieldReader& in) {
  GatewayLine out{.gateway = in.text(2), .line = in.text(2)};
  in.require(is_valid(out));
  return out;
}

void write(FieldWriter& out, const std::vector<GatewayLine>& lines) {
  out.number(lines.size(), 4);
  for (const GatewayLine& line : lines) {
    write(out, line);
  }
}

std::vector<GatewayLine> read_lines(FieldReader& in) {
  std::vector<GatewayLine> out;
  auto left = in.number<std::uint32_t>();
  in.require(left <= kMostPeerLines);
  for (; left > 0 && in.good(); --left) {
    out.push_back(read_line(in));
  }
  return out;
}

void write(FieldWriter& out, const std::vector<std::string>& texts) {
  out.number(texts.size(), 2);
  for (const std::string& text : texts) {
    out.sized(text, 2);
  }
}

std::vector<std::string> read_texts(FieldReader& in) {
  std::vector<std::string> out;
  for (auto left = in.number<std::uint16_t>(); left > 0 && in.good(); --left) {
    out.push_back(in.text(2));
  }
  return out;
}

// Both kinds of requests have the same members.
template <class Network>
void write_target(FieldWriter& out, const Network& request) {
  out.number(request.network, 2);
  out.number(request.node, 1);
  out.number(request.address.index, 2);
  out.number(request.address.sub, 1);
  out.number(request.as_device ? 1 : 0, 1);
  out.number(request.hops, 1);
}

template <class Network>
Network read_target(FieldReader& in) {
  Network out;
  out.network = in.number<std::uint16_t>();
  out.node = in.number<std::uint8_t>();
  out.address.index = in.number<std::uint16_t>();
  out.address.sub = in.number<std::uint8_t>();
  out.as_device = in.number<std::uint8_t>() != 0;
  out.hops = in.number<std::uint8_t>();
  return out;
}

template <class Value>
std::optional<Value> if_complete(const FieldReader& in, Value value) {
  return in.complete() ? std::optional(std::move(value)) : std::nullopt;
}

}  // namespace

std::uint8_t kind_of(PeerBytes message) {
  return message.empty() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(message.front());
}

// --- to the process -----------------------------------------------------------------------------

PeerMessage encode(const PeerSettings& settings) {
  FieldWriter out = message_of(ToPeers::configure);
  out.sized(settings.gateway, 2);
  out.number(settings.domain, 4);
  write(out, settings.interfaces);
  write(out, settings.peers);
  write(out, settings.servers);
  out.sized(settings.profile, 2);
  out.number(settings.guard ? 1 : 0, 1);
  out.number(settings.secured ? 1 : 0, 1);
  out.sized(settings.identity, 2);
  out.number(settings.events ? 1 : 0, 1);
  return out.take();
}

std::optional<PeerSettings> decode_settings(PeerBytes message) {
  FieldReader in = content_of(message);
  PeerSettings out;
  out.gateway = in.text(2);
  out.domain = in.number<std::uint32_t>();
  out.interfaces = read_texts(in);
  out.peers = read_texts(in);
  out.servers = read_texts(in);
  out.profile = in.text(2);
  out.guard = in.number<std::uint8_t>() != 0;
  out.secured = in.number<std::uint8_t>() != 0;
  out.identity = in.text(2);
  out.events = in.number<std::uint8_t>() != 0;
  return if_complete(in, std::move(out));
}

PeerMessage encode(const PeerLines& lines) {
  FieldWriter out = message_of(ToPeers::lines);
  write(out, lines.addressed);
  write(out, lines.emcys);
  return out.take();
}

std::optional<PeerLines> decode_lines(PeerBytes message) {
  FieldReader in = content_of(message);
  PeerLines out{.addressed = read_lines(in), .emcys = read_lines(in)};
  return if_complete(in, std::move(out));
}

PeerMessage encode(const PeerSend& send) {
  FieldWriter out = message_of(ToPeers::send);
  out.number(send.id, 8);
  write(out, send.to);
  out.number(send.incarnation, 8);
  out.number(static_cast<std::uint64_t>(send.deadline.time_since_epoch().count()), 8);
  const auto* const write_request = std::get_if<line::NetworkWrite>(&send.request);
  out.number(write_request != nullptr ? 1 : 0, 1);
  if (write_request != nullptr) {
    write_target(out, *write_request);
    out.sized(std::span(write_request->data), 4);
  } else {
    write_target(out, std::get<line::NetworkRead>(send.request));
  }
  return out.take();
}

std::optional<PeerSend> decode_send(PeerBytes message) {
  FieldReader in = content_of(message);
  PeerSend out;
  out.id = in.number<std::uint64_t>();
  out.to = read_line(in);
  out.incarnation = in.number<std::uint64_t>();
  out.deadline = Instant{Duration{in.number<std::int64_t>()}};
  if (in.number<std::uint8_t>() != 0) {
    auto request = read_target<line::NetworkWrite>(in);
    request.data = in.sized(4);
    out.request = std::move(request);
  } else {
    out.request = read_target<line::NetworkRead>(in);
  }
  return if_complete(in, std::move(out));
}

PeerMessage encode_cancel(std::uint64_t id) {
  FieldWriter out = message_of(ToPeers::cancel);
  out.number(id, 8);
  return out.take();
}

PeerMessage encode_stop() {
  return message_of(ToPeers::stop).take();
}

// --- from the process ---------------------------------------------------------------------------

bool is_valid(const GatewayLine& line) {
  return !line.gateway.empty() && line.gateway.size() <= kLongestLineName && !line.line.empty() &&
         line.line.size() <= kLongestLineName;
}

bool is_valid(const PeerState& state) {
  return is_valid(state.line);
}

bool is_valid(const PeerEventOf& of) {
  const auto& emcy = of.event.emcy;
  return is_valid(of.line) && of.event.stream != 0 &&
         (!emcy || (emcy->node >= 1 && emcy->node <= can::kMaxNodeId && emcy->hops >= 1 &&
                    emcy->hops <= kMostPeerHops && (emcy->network == 0) != of.event.routed));
}

// Longer data are cut by encode().
bool is_valid(const PeerAnswer& answer) {
  return static_cast<std::uint8_t>(answer.error.domain) <=
         static_cast<std::uint8_t>(Domain::command);
}

PeerMessage encode_ready() {
  return message_of(FromPeers::ready).take();
}

PeerMessage encode(const PeerState& state) {
  FieldWriter out = message_of(FromPeers::state);
  write(out, state.line);
  out.number(state.incarnation, 8);
  out.number(static_cast<std::uint64_t>(state.time), 8);
  out.number(state.network, 2);
  return out.take();
}

std::optional<PeerState> decode_state(PeerBytes message) {
  FieldReader in = content_of(message);
  PeerState out;
  out.line = read_line(in);
  out.incarnation = in.number<std::uint64_t>();
  out.time = in.number<std::int64_t>();
  out.network = in.number<std::uint16_t>();
  return if_complete(in, std::move(out));
}

// The EMCY is that of its frame (stack/routing/emcy_frame.h), with a network of its own, because 0
// is none there.
PeerMessage encode(const PeerEventOf& of) {
  FieldWriter out = message_of(FromPeers::event);
  write(out, of.line);
  out.number(of.incarnation, 8);
  out.number(of.event.stream, 8);
  out.number(of.event.number, 8);
  out.number(static_cast<std::uint64_t>(of.event.time), 8);
  out.number(of.event.node, 1);
  out.number(of.event.routed ? 1 : 0, 1);
  out.number(of.event.emcy ? 1 : 0, 1);
  const routing::ForwardedEmcy emcy = of.event.emcy.value_or(routing::ForwardedEmcy{});
  out.number(emcy.code, 2);
  out.number(emcy.error_register, 1);
  out.number(emcy.network, 2);
  out.number(emcy.node, 1);
  out.number(emcy.hops, 1);
  out.number(emcy.number, 1);
  return out.take();
}

std::optional<PeerEventOf> decode_event(PeerBytes message) {
  FieldReader in = content_of(message);
  PeerEventOf out;
  out.line = read_line(in);
  out.incarnation = in.number<std::uint64_t>();
  out.event.stream = in.number<std::uint64_t>();
  out.event.number = in.number<std::uint64_t>();
  out.event.time = in.number<std::int64_t>();
  out.event.node = in.number<std::uint8_t>();
  out.event.routed = in.number<std::uint8_t>() != 0;
  const bool is_emcy = in.number<std::uint8_t>() != 0;
  routing::ForwardedEmcy emcy;
  emcy.code = in.number<std::uint16_t>();
  emcy.error_register = in.number<std::uint8_t>();
  emcy.network = in.number<std::uint16_t>();
  emcy.node = in.number<std::uint8_t>();
  emcy.hops = in.number<std::uint8_t>();
  emcy.number = in.number<std::uint8_t>();
  out.event.emcy = is_emcy ? std::optional(emcy) : std::nullopt;
  in.require(is_valid(out));
  return if_complete(in, std::move(out));
}

PeerMessage encode_gone(const GatewayLine& line) {
  FieldWriter out = message_of(FromPeers::gone);
  write(out, line);
  return out.take();
}

std::optional<GatewayLine> decode_gone(PeerBytes message) {
  FieldReader in = content_of(message);
  GatewayLine out = read_line(in);
  return if_complete(in, std::move(out));
}

PeerMessage encode(const PeerAnswer& answer) {
  FieldWriter out = message_of(FromPeers::answer);
  out.number(answer.id, 8);
  out.number(static_cast<std::uint64_t>(answer.error.domain), 1);
  out.number(answer.error.code, 4);
  out.sized(std::span(answer.data).first(std::min(answer.data.size(), kLongestPeerValue)), 4);
  return out.take();
}

std::optional<PeerAnswer> decode_answer(PeerBytes message) {
  FieldReader in = content_of(message);
  PeerAnswer out;
  out.id = in.number<std::uint64_t>();
  out.error.domain = static_cast<Domain>(in.number<std::uint8_t>());
  out.error.code = in.number<std::uint32_t>();
  out.data = in.sized(4);
  in.require(is_valid(out) && out.data.size() <= kLongestPeerValue);
  return if_complete(in, std::move(out));
}

PeerMessage encode_expiry(std::int64_t time) {
  FieldWriter out = message_of(FromPeers::expiry);
  out.number(static_cast<std::uint64_t>(time), 8);
  return out.take();
}

std::optional<std::uint64_t> decode_number(PeerBytes message) {
  FieldReader in = content_of(message);
  const auto out = in.number<std::uint64_t>();
  return if_complete(in, out);
}

}  // namespace linegate::gateway
