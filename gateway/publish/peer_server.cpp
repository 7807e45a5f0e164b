// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_server.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace linegate::gateway {

using routing::GatewayLine;

PeerServer::PeerServer(PeerClient& client, std::function<Instant()> now)
    : client_(client), now_(std::move(now)) {
  waiting_.push_back(encode_ready());
}

bool PeerServer::handle(PeerBytes message) {
  switch (static_cast<ToPeers>(kind_of(message))) {
    case ToPeers::lines:
      return set_lines(message);
    case ToPeers::send:
      return start(message);
    case ToPeers::cancel:
      return cancel(message);
    case ToPeers::configure:  // only once
    case ToPeers::stop:
      break;
  }
  return false;
}

bool PeerServer::set_lines(PeerBytes message) {
  const auto lines = decode_lines(message);
  if (!lines) {
    return false;
  }
  lines_ = {lines->addressed.begin(), lines->addressed.end()};
  lines_.insert(lines->emcys.begin(), lines->emcys.end());
  client_.set_lines(lines->addressed, lines->emcys);
  return true;
}

bool PeerServer::start(PeerBytes message) {
  const auto send = decode_send(message);
  if (!send) {
    return false;
  }
  const Duration left = send->deadline - now_();
  const std::uint64_t id =
      left > Duration::zero() ? client_.send(send->to, send->incarnation, send->request, left) : 0;
  if (id != 0) {
    requests_[id] = send->id;
  } else {
    waiting_.push_back(
        encode(PeerAnswer{.id = send->id, .error = line::to_error(line::Refusal::timed_out)}));
  }
  return true;
}

bool PeerServer::cancel(PeerBytes message) {
  const auto id = decode_number(message);
  if (!id) {
    return false;
  }
  const auto request =
      std::ranges::find_if(requests_, [&](const auto& each) { return each.second == *id; });
  if (request != requests_.end()) {
    client_.cancel(request->first);
    requests_.erase(request);
  }
  return true;
}

bool PeerServer::poll(Duration timeout, const Send& send) {
  client_.poll(waiting_.empty() ? timeout : Duration::zero(), *this);
  while (!waiting_.empty()) {
    if (!send(waiting_.front())) {
      return false;
    }
    waiting_.pop_front();
  }
  return true;
}

void PeerServer::report_expiry(std::int64_t time) {
  if (std::exchange(expiry_, time) != time) {
    waiting_.push_back(encode_expiry(time));
  }
}

void PeerServer::on_state(const GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                          std::uint16_t network) {
  const PeerState state{line, incarnation, time, network};
  if (lines_.contains(line) && is_valid(state) && waiting_.size() < kMostWaiting) {
    waiting_.push_back(encode(state));
  }
}

void PeerServer::on_event(const GatewayLine& line, std::uint64_t incarnation,
                          const PeerEvent& event) {
  const PeerEventOf of{line, incarnation, event};
  if (lines_.contains(line) && is_valid(of) && waiting_.size() < kMostEventsWaiting) {
    waiting_.push_back(encode(of));
  }
}

void PeerServer::on_gone(const GatewayLine& line) {
  if (lines_.contains(line)) {
    waiting_.push_back(encode_gone(line));
  }
}

void PeerServer::on_answer(std::uint64_t id, const line::Reply& reply) {
  const auto request = requests_.find(id);
  if (request == requests_.end()) {
    return;
  }
  PeerAnswer answer{.id = request->second, .error = reply.error, .data = reply.bytes()};
  if (!is_valid(answer)) {
    answer = {.id = answer.id, .error = line::to_error(line::Refusal::timed_out)};
  }
  waiting_.push_back(encode(answer));
  requests_.erase(request);
}

}  // namespace linegate::gateway
