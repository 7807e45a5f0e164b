// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_routes.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {
namespace {

using line::Refusal;
using routing::GatewayAnswer;
using routing::GatewayLine;
using routing::GatewayRequest;

// A former incarnation may have sent states until its end that are received after the first of the
// next one.
constexpr Duration kOfFormer = std::chrono::seconds(1);

// What the client of the transfer receives for a request that was certainly not carried out;
// nothing if it may have been: it was under way when its time-out passed, or when the other gateway
// stopped, or it was addressed to an incarnation that has ended since.
std::optional<AbortCode> abort_of(Refusal refusal) {
  switch (refusal) {
    case Refusal::busy:
      return AbortCode::sdo_connection;
    case Refusal::not_permitted:
    case Refusal::no_right:
      return AbortCode::local_control;
    case Refusal::line_down:
    case Refusal::wrong_state:
    case Refusal::image_pdo:
      return AbortCode::device_state;
    case Refusal::bad_request:
    case Refusal::unknown_line:
    case Refusal::wrong_role:
      return AbortCode::general;
    default:
      return std::nullopt;
  }
}

GatewayAnswer answer_of(std::uint64_t number, const line::Reply& reply) {
  GatewayAnswer out{.number = number};
  std::optional<AbortCode> abort;
  switch (reply.error.domain) {
    case Domain::none:
      out.data = reply.bytes();
      return out;
    case Domain::sdo:
      abort = static_cast<AbortCode>(reply.error.code);
      abort = *abort == AbortCode::none ? AbortCode::general : *abort;
      break;
    case Domain::command:
      abort = abort_of(static_cast<Refusal>(reply.error.code));
      break;
    default:
      break;
  }
  out.abort = abort.value_or(AbortCode::timeout);
  out.unknown = out.abort == AbortCode::timeout;  // also of the target: it did not answer in time
  return out;
}

line::Request command_of(GatewayRequest& request) {
  const bool as_device = !request.way->enter.empty();
  if (!request.write) {
    return line::NetworkRead{.network = request.network,
                             .node = request.node,
                             .address = request.address,
                             .as_device = as_device,
                             .hops = request.hops};
  }
  return line::NetworkWrite{.network = request.network,
                            .node = request.node,
                            .address = request.address,
                            .as_device = as_device,
                            .data = std::move(request.data),
                            .hops = request.hops};
}

}  // namespace

// --- the other gateways -------------------------------------------------------------------------

void PeerRoutes::set_lines(const std::vector<GatewayLine>& lines, Instant now) {
  std::map<GatewayLine, Peer> known = std::exchange(peers_, {});
  for (const GatewayLine& line : lines) {
    const auto before = known.find(line);
    peers_[line] = before == known.end() ? Peer{} : before->second;
  }
  for (auto& [line, peer] : known) {
    if (peer.under_way != 0) {
      peers_.try_emplace(line, peer);  // until its requests have ended
    }
  }
  report_present(now, true);
}

void PeerRoutes::take_state(const GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                            Instant now) {
  const auto peer = peers_.find(line);
  // No gateway has the incarnation 0, and requests to it would be carried out by any.
  if (peer == peers_.end() || incarnation == 0) {
    return;
  }
  std::vector<Publisher>& known = peer->second.publishers;
  const auto publisher = std::ranges::find(known, incarnation, &Publisher::incarnation);
  if (publisher != known.end()) {
    // A state that DDS repeats for late subscribers does not show that the line runs.
    publisher->heard = publisher->time == time ? publisher->heard : now;
    publisher->time = time;
  } else {
    if (known.size() >= kMostPublishers) {
      const auto oldest = std::ranges::min_element(known, {}, &Publisher::heard);
      if (now - oldest->heard < kSilence) {
        return;
      }
      known.erase(oldest);
    }
    known.push_back({.incarnation = incarnation, .began = now, .heard = now, .time = time});
  }
  report_present(now, false);
}

void PeerRoutes::take_end(const GatewayLine& line, Instant now) {
  if (const auto peer = peers_.find(line); peer != peers_.end()) {
    peer->second.publishers.clear();
    report_present(now, false);
  }
}

// That of the last one that began, if earlier ones have ended; nothing if there is none.
std::optional<std::uint64_t> PeerRoutes::incarnation_of(const Peer& peer, Instant now) {
  const Publisher* newest = nullptr;
  for (const Publisher& each : peer.publishers) {
    newest = now - each.heard < kSilence ? &each : newest;
  }
  if (newest == nullptr) {
    return std::nullopt;
  }
  const bool is_disputed = std::ranges::any_of(peer.publishers, [&](const Publisher& each) {
    return &each != newest && now - each.heard < kSilence && each.heard > newest->began + kOfFormer;
  });
  return is_disputed ? std::nullopt : std::optional(newest->incarnation);
}

std::optional<std::uint64_t> PeerRoutes::publisher_of(const GatewayLine& line, Instant now) const {
  const auto peer = peers_.find(line);
  return peer == peers_.end() ? std::nullopt : incarnation_of(peer->second, now);
}

void PeerRoutes::report_present(Instant now, bool anyway) {
  std::vector<GatewayLine> present;
  bool has_changed = anyway;
  for (auto& [line, peer] : peers_) {
    const bool is_present = incarnation_of(peer, now).has_value();
    has_changed |= std::exchange(peer.is_present, is_present) != is_present;
    if (is_present) {
      present.push_back(line);
    }
  }
  if (has_changed) {
    sink_.set_present(present);
  }
}

// --- requests -----------------------------------------------------------------------------------

void PeerRoutes::take(PeerClient& client, const std::string& line, GatewayRequest request,
                      Instant now) {
  if (request.cancelled) {
    cancel(client, line, request.number);
    return;
  }
  const GatewayLine to = request.way->addressed();
  const auto peer = peers_.find(to);
  const auto incarnation = peer == peers_.end() ? std::nullopt : incarnation_of(peer->second, now);
  if (!incarnation || now >= request.deadline) {
    answer(line, {.number = request.number, .abort = AbortCode::timeout});
    return;
  }
  if (peer->second.under_way >= kMostUnderWay) {
    answer(line, {.number = request.number, .abort = AbortCode::out_of_memory});
    return;
  }
  const Request sent{.line = line, .number = request.number, .write = request.write, .to = to};
  const Duration left = request.deadline - now;
  const std::uint64_t id = client.send(to, *incarnation, command_of(request), left);
  if (id == 0) {
    answer(line, {.number = request.number, .abort = AbortCode::out_of_memory});
    return;
  }
  ++peer->second.under_way;
  requests_[id] = sent;
}

void PeerRoutes::take_answer(std::uint64_t id, const line::Reply& reply) {
  const auto request = requests_.find(id);
  if (request == requests_.end()) {
    return;
  }
  GatewayAnswer out = answer_of(request->second.number, reply);
  const std::string line = request->second.line;
  end(request);
  answer(line, std::move(out));
}

void PeerRoutes::cancel(PeerClient& client, const std::string& line, std::uint64_t number) {
  const auto request = std::ranges::find_if(requests_, [&](const auto& each) {
    return each.second.number == number && each.second.line == line;
  });
  if (request != requests_.end()) {
    client.cancel(request->first);
    end(request);
  }
}

void PeerRoutes::forget(PeerClient& client, const std::string& line) {
  for (auto request = requests_.begin(); request != requests_.end();) {
    const auto next = std::next(request);
    if (request->second.line == line) {
      client.cancel(request->first);
      end(request);
    }
    request = next;
  }
  std::erase_if(answers_, [&](const Answer& each) { return each.line == line; });
}

void PeerRoutes::end_requests(PeerClient& client) {
  while (!requests_.empty()) {
    const auto request = requests_.begin();
    client.cancel(request->first);
    const std::string line = request->second.line;
    GatewayAnswer out{
        .number = request->second.number, .abort = AbortCode::timeout, .unknown = true};
    end(request);
    answer(line, std::move(out));
  }
}

void PeerRoutes::end(std::map<std::uint64_t, Request>::iterator request) {
  if (const auto peer = peers_.find(request->second.to); peer != peers_.end()) {
    --peer->second.under_way;
  }
  requests_.erase(request);
}

void PeerRoutes::answer(const std::string& line, GatewayAnswer answer) {
  if (!answers_.empty() || !sink_.answer(line, answer)) {
    answers_.push_back({line, std::move(answer)});
  }
}

void PeerRoutes::advance(Instant now) {
  report_present(now, false);
  for (std::size_t left = answers_.size(); left > 0; --left) {
    Answer next = std::move(answers_.front());
    answers_.pop_front();
    if (!sink_.answer(next.line, next.answer)) {
      answers_.push_back(std::move(next));
    }
  }
}

}  // namespace linegate::gateway
