// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/gateway_egress.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/routing/access.h"
#include "stack/routing/passage_times.h"

namespace linegate::routing {
namespace {

constexpr Duration kMostRestart = std::chrono::milliseconds(50);

}  // namespace

struct GatewayEgress::Passage final : ValueServer::Target {
  Passage(GatewayEgress& egress, EventLog& events, Duration frame_timeout)
      : owner(egress), server(*this, events, frame_timeout) {}

  // The command of the other gateway has at least one byte.
  AbortCode ask(od::Address address, bool writes, std::span<const std::byte> value) override {
    if (writes && value.empty()) {
      return AbortCode::length_too_low;
    }
    owner.ask(*this, address, writes, {value.begin(), value.end()});
    return AbortCode::none;
  }
  void withdrawn() override { owner.withdraw(*this); }

  GatewayEgress& owner;
  bool is_open = false;
  std::uint8_t interface = 0;
  std::uint8_t to = 0;  // interface of the ingress
  std::uint8_t node = 0;
  std::uint8_t hops = 0;
  std::uint16_t network = 0;
  std::uint16_t source = 0;
  std::uint32_t connection = 0;
  std::uint32_t client = 0;
  std::shared_ptr<const GatewayWay> way;
  ValueServer server;
  // The request under way; 0 = none
  std::uint64_t number = 0;
  od::Address asked;
  bool write = false;
  bool handed_out = false;
  PassageTimes times;
};

GatewayEgress::GatewayEgress(const Config& config, Duration sdo_timeout, Post& post,
                             EventLog& events, Counters& counters)
    : config_(config),
      sdo_timeout_(sdo_timeout),
      post_(post),
      events_(events),
      counters_(counters) {
}

GatewayEgress::~GatewayEgress() = default;

GatewayEgress::Passage* GatewayEgress::find(std::uint8_t interface,
                                            std::uint32_t connection) const {
  for (const auto& each : passages_) {
    if (each->is_open && each->connection == connection && each->interface == interface) {
      return each.get();
    }
  }
  return nullptr;
}

GatewayEgress::Passage* GatewayEgress::find(std::uint64_t number) const {
  for (const auto& each : passages_) {
    if (number != 0 && each->number == number) {
      return each.get();
    }
  }
  return nullptr;
}

// --- opening ------------------------------------------------------------------------------------

void GatewayEgress::deliver(const Message& message, Instant now) {
  now_ = now;
  if (message.kind == MessageKind::sdo_open) {
    open(message, now);
    return;
  }
  Passage* const passage = find(message.to, message.connection);
  if (passage == nullptr) {
    ++counters_.unexpected;
  } else if (message.kind == MessageKind::sdo_request) {
    request(*passage, word_of(message), now);
  } else {
    release(*passage);
  }
}

AbortCode GatewayEgress::refusal_of(const Message& message, const GatewayWay* way) const {
  if (way == nullptr || message.node < can::kMinNodeId || message.node > can::kMaxNodeId) {
    return AbortCode::invalid_value;  // the other gateway itself has no node-ID that A command
                                      // names
  }
  if (std::ranges::find(present_, way->addressed()) == present_.end()) {
    return AbortCode::timeout;
  }
  const std::uint32_t client = client_of(message);
  std::size_t open = 0;
  std::size_t of_client = 0;
  for (const auto& each : passages_) {
    open += each->is_open ? 1U : 0U;
    of_client += each->is_open && each->client == client ? 1U : 0U;
  }
  const bool is_crowded = client != 0 && of_client >= kMostOfOneClient;
  return open >= kMost || is_crowded ? AbortCode::out_of_memory : AbortCode::none;
}

void GatewayEgress::open(const Message& message, Instant now) {
  if (find(message.to, message.connection) != nullptr) {
    ++counters_.unexpected;
    return;
  }
  auto way = find_way(config_.interfaces, message.to);
  if (const AbortCode why = refusal_of(message, way.get()); why != AbortCode::none) {
    (void)post_.send_from(message.to, refusal(message, why));
    return;
  }
  Passage& made = make(message);
  made.way = std::move(way);
  // A fallback in case the ingress, which has the arm timer, no longer exists.
  made.times.deadline = now + config_.arm_timeout + client_timeout();
  wake_ = earlier(wake_, made.times.wake(made.server));
  (void)post_.send_from(made.interface,
                        to_connection(MessageKind::sdo_opened, made.to, made.connection, 0));
}

GatewayEgress::Passage& GatewayEgress::make(const Message& open) {
  auto place = std::ranges::find_if(passages_, [](const auto& each) { return !each->is_open; });
  if (place == passages_.end()) {
    passages_.emplace_back();
    place = passages_.end() - 1;
  }
  // Nothing remains of the connection before, such as segments that its server expects.
  *place = std::make_unique<Passage>(*this, events_, client_timeout());
  Passage& made = **place;
  made.is_open = true;
  made.interface = open.to;
  made.to = open.from;
  made.node = open.node;
  made.hops = static_cast<std::uint8_t>(open.hops + 1);
  made.network = open.network;
  made.source = open.source;
  made.connection = open.connection;
  made.client = client_of(open);
  return made;
}

// --- frames -------------------------------------------------------------------------------------

void GatewayEgress::request(Passage& passage, std::uint64_t word, Instant now) {
  const SdoPhase::End end = passage.server.request(word, now);
  if (passage.number == 0) {
    passage.times.deadline = now + client_timeout();
  }
  pump(passage);
  if (end != SdoPhase::End::none && passage.is_open) {
    release(passage);
  }
}

void GatewayEgress::pump(Passage& passage) {
  while (passage.is_open) {
    const auto answer = passage.server.pop();
    if (!answer) {
      wake_ = earlier(wake_, passage.times.wake(passage.server));
      return;
    }
    respond(passage, *answer);
  }
}

void GatewayEgress::respond(Passage& passage, ValueServer::Answer answer) {
  if (!post_.send_from(passage.interface, to_connection(MessageKind::sdo_response, passage.to,
                                                        passage.connection, answer.word))) {
    break_down(passage, AbortCode::out_of_memory);
  } else if (answer.end != SdoPhase::End::none) {
    release(passage);
  }
}

// --- requests -----------------------------------------------------------------------------------

void GatewayEgress::ask(Passage& passage, od::Address address, bool write,
                        std::vector<std::byte> data) {
  LINEGATE_ASSERT(passage.number == 0, "a server has one transfer at a time");
  passage.number = ++numbers_;
  passage.asked = address;
  passage.write = write;
  passage.handed_out = false;
  const Duration period = restart_period(client_timeout(), kMostRestart);
  passage.times.begin_request(now_ + passage.way->timeout, now_ + period);
  outbox_.push_back({.number = passage.number,
                     .way = passage.way,
                     .deadline = passage.times.deadline,
                     .network = passage.network,
                     .node = passage.node,
                     .hops = passage.hops,
                     .address = address,
                     .write = write,
                     .data = std::move(data)});
  wake_ = earlier(wake_, passage.times.wake(passage.server));
}

bool GatewayEgress::pop(GatewayRequest& out) {
  if (outbox_.empty()) {
    return false;
  }
  out = std::move(outbox_.front());
  outbox_.pop_front();
  if (Passage* const passage = find(out.number)) {
    passage->handed_out = true;
  }
  return true;
}

void GatewayEgress::withdraw(Passage& passage) {
  if (passage.number == 0) {
    return;
  }
  const std::uint64_t number = std::exchange(passage.number, 0);
  if (passage.handed_out) {
    outbox_.push_back({.number = number, .cancelled = true});
    report_unknown(passage, now_);
  } else {
    std::erase_if(outbox_, [&](const GatewayRequest& each) { return each.number == number; });
  }
  passage.times.restart_at = kNever;
}

void GatewayEgress::answer(GatewayAnswer answer, Instant now) {
  now_ = now;
  Passage* const found = find(answer.number);
  if (found == nullptr) {
    ++counters_.unexpected;
    return;
  }
  Passage& passage = *found;
  if (answer.unknown) {
    report_unknown(passage, now);
  }
  passage.number = 0;
  finish(passage, answer.unknown ? AbortCode::timeout : answer.abort, answer.data, now);
}

// The access that waits has a result.
void GatewayEgress::finish(Passage& passage, AbortCode why, std::span<const std::byte> value,
                           Instant now) {
  passage.times.end_request(now + client_timeout());
  passage.server.finish(why, value, now);
  pump(passage);
}

void GatewayEgress::report_unknown(const Passage& passage, Instant now) {
  if (!passage.write) {
    return;
  }
  events_.emit({.time = now,
                .data = event::RoutingUnanswered{.source = passage.source,
                                                 .target = passage.network,
                                                 .index = passage.asked.index,
                                                 .sub = passage.asked.sub,
                                                 .target_node = passage.node,
                                                 .interface = passage.interface}});
}

// --- the end ------------------------------------------------------------------------------------

void GatewayEgress::break_down(Passage& passage, AbortCode why) {
  (void)post_.send_from(passage.interface,
                        to_connection(MessageKind::sdo_refused, passage.to, passage.connection,
                                      static_cast<std::uint32_t>(why)));
  release(passage);
}

void GatewayEgress::release(Passage& passage) {
  passage.server.reset();  // withdraws the request under way
  LINEGATE_ASSERT(passage.number == 0, "no request without a connection");
  passage.is_open = false;
  passage.way = nullptr;
  passage.times = {};
}

void GatewayEgress::stop(Instant now) {
  now_ = now;
  for (const auto& each : passages_) {
    if (each->is_open && each->number != 0) {
      expire(*each);
    }
    if (each->is_open) {
      break_down(*each, AbortCode::device_state);
    }
  }
}

// --- time ---------------------------------------------------------------------------------------

Duration GatewayEgress::client_timeout() const {
  return client_frame_timeout(config_, sdo_timeout_);
}

void GatewayEgress::advance(Instant now) {
  now_ = now;
  if (now >= wake_) {
    wake_ = kNever;
    const Instant next = advance_passages(passages_, *this, now);
    wake_ = earlier(wake_, next);
  }
}

// No response is due while the other gateway carries out the request.
void GatewayEgress::keep_waiting(Passage& passage) {
  passage.times.restart_at = now_ + restart_period(client_timeout(), kMostRestart);
  (void)post_.send_from(passage.interface,
                        to_connection(MessageKind::sdo_paced, passage.to, passage.connection, 0));
}

void GatewayEgress::expire(Passage& passage) {
  if (passage.number == 0) {
    break_down(passage, AbortCode::timeout);
    return;
  }
  withdraw(passage);
  finish(passage, AbortCode::timeout, {}, now_);
}

}  // namespace linegate::routing
