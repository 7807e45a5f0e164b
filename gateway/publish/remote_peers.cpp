// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/remote_peers.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {

using routing::GatewayLine;

RemotePeers::RemotePeers(std::unique_ptr<PeerLink> link, PeerSettings settings,
                         std::function<Instant()> now, Renewal renewal)
    : link_(std::move(link)),
      settings_(std::move(settings)),
      now_(std::move(now)),
      renewal_(std::move(renewal)) {
}

RemotePeers::~RemotePeers() {
  const bool asked = is_running() && link_->send(process_, encode_stop());
  link_->finish(asked ? kToEnd : Duration::zero());
}

void RemotePeers::set_lines(const std::vector<GatewayLine>& addressed,
                            const std::vector<GatewayLine>& emcys) {
  lines_ = {.addressed = addressed, .emcys = emcys};
  wanted_ = {addressed.begin(), addressed.end()};
  wanted_.insert(emcys.begin(), emcys.end());
  std::erase_if(reported_, [&](const GatewayLine& line) { return !wanted_.contains(line); });
  has_lines_ = is_running() && link_->send(process_, encode(lines_));
}

std::uint64_t RemotePeers::send(const GatewayLine& to, std::uint64_t incarnation,
                                const line::Request& request, Duration timeout) {
  const PeerSend message{.id = next_id_,
                         .to = to,
                         .incarnation = incarnation,
                         .deadline = now_() + timeout,
                         .request = request};
  if (process_ == 0 || process_ == ending_ || !link_->send(process_, encode(message))) {
    return 0;
  }
  under_way_[next_id_] = message.deadline;
  return next_id_++;
}

// Without room the process answers later, and the answer is ignored.
void RemotePeers::cancel(std::uint64_t id) {
  if (under_way_.erase(id) != 0 && process_ != 0) {
    link_->send(process_, encode_cancel(id));
  }
}

void RemotePeers::poll(Duration timeout, PeerHandler& handler) {
  follow_process(handler);
  if (!receive(handler)) {
    Duration wait = timeout;
    for (const auto& [id, deadline] : under_way_) {
      wait = std::clamp(deadline - now_(), Duration::zero(), wait);
    }
    link_->wait(wait);
    follow_process(handler);
    receive(handler);
  }
  end_requests(now_(), handler);
  renew();
}

// What the last process had is lost; another one begins with the settings.
void RemotePeers::follow_process(PeerHandler& handler) {
  const std::uint64_t number = link_->number();
  if (number != process_) {
    process_ = 0;
    has_lines_ = false;
    end_requests(kNever, handler);
    for (const GatewayLine& line : std::exchange(reported_, {})) {
      handler.on_gone(line);
    }
    next_expiry_ = 0;
    renewal_due_.clear();
    if (number != 0 && link_->send(number, encode(settings_))) {
      process_ = number;
      renewal_.started(now_());
    }
  }
  if (process_ != 0 && !has_lines_) {
    has_lines_ = link_->send(process_, encode(lines_));
  }
}

// Answers the requests whose deadline is not later.
void RemotePeers::end_requests(Instant until, PeerHandler& handler) {
  for (auto request = under_way_.begin(); request != under_way_.end();) {
    if (request->second > until) {
      ++request;
      continue;
    }
    const std::uint64_t id = request->first;
    request = under_way_.erase(request);
    handler.on_answer(id, {.tag = id, .error = line::to_error(line::Refusal::timed_out)});
  }
}

// --- messages of the process --------------------------------------------------------------------

// Returns false if there was none.
bool RemotePeers::receive(PeerHandler& handler) {
  PeerMessage message;
  bool any = false;
  for (int i = 0; i < kMostMessages; ++i) {
    const std::uint64_t from = link_->receive(message);
    if (from == 0) {
      break;
    }
    any = true;
    if (from != process_) {
      follow_process(handler);  // a new one, which may send nothing before it has the settings
    } else if (take(message, handler)) {
      continue;
    }
    link_->reject(from, "it sent a malformed message about other gateways");
    break;
  }
  return any;
}

bool RemotePeers::take(PeerBytes message, PeerHandler& handler) {
  switch (static_cast<FromPeers>(kind_of(message))) {
    case FromPeers::ready:
      return message.size() == 1;
    case FromPeers::state:
      return take_state(message, handler);
    case FromPeers::event:
      return take_event(message, handler);
    case FromPeers::gone:
      return take_gone(message, handler);
    case FromPeers::answer:
      return take_answer(message, handler);
    case FromPeers::expiry: {
      const auto time = decode_number(message);
      next_expiry_ = static_cast<std::int64_t>(time.value_or(0));
      return time.has_value();
    }
  }
  return false;
}

// Of lines that are no longer wanted, messages may be under way.
bool RemotePeers::take_state(PeerBytes message, PeerHandler& handler) {
  const auto state = decode_state(message);
  if (state && wanted_.contains(state->line)) {
    reported_.insert(state->line);
    handler.on_state(state->line, state->incarnation, state->time, state->network);
  }
  return state.has_value();
}

bool RemotePeers::take_event(PeerBytes message, PeerHandler& handler) {
  const auto of = decode_event(message);
  if (of && wanted_.contains(of->line)) {
    handler.on_event(of->line, of->incarnation, of->event);
  }
  return of.has_value();
}

bool RemotePeers::take_gone(PeerBytes message, PeerHandler& handler) {
  const auto line = decode_gone(message);
  if (line && reported_.erase(*line) != 0) {
    handler.on_gone(*line);
  }
  return line.has_value();
}

// A request that was cancelled, or has ended by its time, may be answered later.
bool RemotePeers::take_answer(PeerBytes message, PeerHandler& handler) {
  auto answer = decode_answer(message);
  if (!answer || answer->id == 0 || answer->id >= next_id_) {
    return false;
  }
  if (under_way_.erase(answer->id) != 0) {
    handler.on_answer(answer->id,
                      {.tag = answer->id, .error = answer->error, .data = std::move(answer->data)});
  }
  return true;
}

// --- identities that lose their access ----------------------------------------------------------

void RemotePeers::renew() {
  if (!renewal_.due || !is_running() || process_ == ending_) {
    return;
  }
  const Instant now = now_();
  if (renewal_due_.empty()) {
    const std::string absent = renewal_.secured ? absence(now) : std::string();
    renewal_due_ = renewal_.due(now, next_expiry_);
    renewal_due_ = renewal_due_.empty() ? absent : renewal_due_;
    renewal_limit_ = now + kForRequests;
  }
  if (renewal_due_.empty() || (!under_way_.empty() && now < renewal_limit_) ||
      !link_->send(process_, encode_stop())) {
    return;
  }
  ending_ = process_;
  link_->replace(process_, renewal_due_);
  renewal_.done(now);
  renewal_due_.clear();
}

// Why the process is to be replaced if a line is absent; empty: it is not.
std::string RemotePeers::absence(Instant now) {
  const auto absent = std::ranges::find_if(
      wanted_, [&](const GatewayLine& line) { return !reported_.contains(line); });
  if (absent == wanted_.end()) {
    absent_since_ = kNever;
    patience_ = kFirstAbsence;
    return {};
  }
  if (absent_since_ == kNever) {
    absent_since_ = now;
  }
  if (now - absent_since_ < patience_) {
    return {};
  }
  absent_since_ = now;
  patience_ = std::min(2 * patience_, kLongestAbsence);
  return absent->gateway + "/" + absent->line + " is not there, or was not authenticated";
}

}  // namespace linegate::gateway
