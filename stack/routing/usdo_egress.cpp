// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/usdo_egress.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/routing/access.h"
#include "stack/routing/passage_times.h"
#include "stack/routing/sdo_ingress.h"

namespace linegate::routing {
namespace {

constexpr Duration kMostUsdoRestart =
    std::chrono::milliseconds(5);  // the time-outs of the line of the client may be short

}  // namespace

struct UsdoEgress::Passage final : ValueServer::Target {
  Passage(UsdoEgress& egress, EventLog& events, Duration frame_timeout)
      : owner(egress), server(*this, events, frame_timeout) {}

  AbortCode ask(od::Address address, bool write, std::span<const std::byte> value) override {
    return owner.ask(*this, address, write, value);
  }
  std::size_t size_of(od::Address address) const override {
    return owner.line_.size_of ? owner.line_.size_of(node, address) : 0;
  }
  void withdrawn() override { owner.withdraw(*this); }
  Indication target() const { return {.network = network, .node = node}; }

  UsdoEgress& owner;
  bool is_open = false;
  std::uint8_t from = 0;  // interface of the ingress
  std::uint8_t node = 0;
  std::uint16_t network = 0;
  std::uint16_t source = 0;
  std::uint32_t connection = 0;
  std::uint32_t client = 0;  // whose command it is, see sdo::Pace; 0 = nobody's
  Permissions permitted;
  ValueServer server;
  std::uint64_t number = 0;  // of the request to the arbiter; 0 = none is under way
  od::Address asked;         // its object
  bool writes = false;
  PassageTimes times;  // deadline: for the arbiter to begin the request
};

UsdoEgress::UsdoEgress(const Config& config, Line line, sdo::Arbiter& arbiter, Post& post,
                       EventLog& events, Counters& counters)
    : config_(config),
      line_(std::move(line)),
      arbiter_(arbiter),
      post_(post),
      events_(events),
      counters_(counters) {
}

UsdoEgress::~UsdoEgress() {
  arbiter_.disown(*this);
}

UsdoEgress::Passage* UsdoEgress::find(std::uint8_t from, std::uint32_t connection) const {
  for (const auto& each : passages_) {
    if (each->is_open && each->connection == connection && each->from == from) {
      return each.get();
    }
  }
  return nullptr;
}

// --- opening ------------------------------------------------------------------------------------

bool UsdoEgress::takes(const Message& message) const {
  if (message.kind == MessageKind::sdo_open) {
    return message.gateway != 0 || (message.node != 0 && message.node != line_.node);
  }
  return find(message.from, message.connection) != nullptr;
}

void UsdoEgress::deliver(const Message& message, Instant now) {
  now_ = now;
  if (message.kind == MessageKind::sdo_open) {
    open(message, now);
    return;
  }
  Passage* const passage = find(message.from, message.connection);
  LINEGATE_ASSERT(passage != nullptr, "the message belongs to a connection");
  if (message.kind == MessageKind::sdo_request) {
    request(*passage, word_of(message), now);
  } else {
    release(*passage);
  }
}

AbortCode UsdoEgress::refusal_of(const Message& message) const {
  if (message.gateway != 0 || message.node > can::kMaxNodeId) {
    return AbortCode::invalid_value;  // remote USDO is not public: no gateway is reached by USDO
  }
  if (!usable_) {
    return AbortCode::device_state;
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

void UsdoEgress::open(const Message& message, Instant now) {
  if (find(message.from, message.connection) != nullptr) {
    ++counters_.unexpected;
    return;
  }
  const Permissions permitted = permissions(config_, message);
  if (permitted.none()) {
    refuse_entry(events_, counters_, post_, message, now);
    return;
  }
  if (const AbortCode why = refusal_of(message); why != AbortCode::none) {
    (void)post_.send(refusal(message, why));
    return;
  }
  Passage& made = make(message);
  made.permitted = permitted;
  // A fallback in case the ingress, which has the arm timer, no longer exists.
  made.times.deadline = now + config_.arm_timeout + client_timeout();
  wake_ = earlier(wake_, made.times.wake(made.server));
  (void)post_.send(to_connection(MessageKind::sdo_opened, made.from, made.connection, 0));
}

UsdoEgress::Passage& UsdoEgress::make(const Message& open) {
  auto place = std::ranges::find_if(passages_, [](const auto& each) { return !each->is_open; });
  if (place == passages_.end()) {
    passages_.emplace_back();
    place = passages_.end() - 1;
  }
  // Nothing remains of the connection before, such as segments that its server expects.
  *place = std::make_unique<Passage>(*this, events_, client_timeout());
  Passage& made = **place;
  made.is_open = true;
  made.from = open.from;
  made.node = open.node;
  made.network = open.network;
  made.source = open.source;
  made.connection = open.connection;
  made.client = client_of(open);
  ++counters_.channels;
  return made;
}

// --- frames of the client -----------------------------------------------------------------------

void UsdoEgress::request(Passage& passage, std::uint64_t word, Instant now) {
  const AbortCode why =
      passage.server.begins(word) ? passage.permitted.refusal(word) : AbortCode::none;
  SdoPhase::End end = SdoPhase::End::none;
  if (why != AbortCode::none) {
    note_not_permitted(events_, counters_, passage.source, passage.target(), why, now);
    passage.server.reset();
    passage.server.refuse(word, why);
  } else {
    end = passage.server.request(word, now);
  }
  if (passage.number == 0) {
    passage.times.deadline = now + client_timeout();
  }
  pump(passage);
  if (end != SdoPhase::End::none && passage.is_open) {
    release(passage);
  }
}

void UsdoEgress::pump(Passage& passage) {
  while (passage.is_open) {
    const auto answer = passage.server.pop();
    if (!answer) {
      wake_ = earlier(wake_, passage.times.wake(passage.server));
      return;
    }
    if (!post_.send(to_connection(MessageKind::sdo_response, passage.from, passage.connection,
                                  answer->word))) {
      break_down(passage, AbortCode::out_of_memory);
    } else if (answer->end != SdoPhase::End::none) {
      release(passage);
    }
  }
}

// --- transfers ----------------------------------------------------------------------------------

AbortCode UsdoEgress::ask(Passage& passage, od::Address address, bool write,
                          std::span<const std::byte> value) {
  LINEGATE_ASSERT(passage.number == 0, "a server has one transfer at a time");
  if (!usable_) {
    return AbortCode::device_state;
  }
  if (write ? !passage.permitted.write : !passage.permitted.read) {
    return write ? AbortCode::read_only : AbortCode::write_only;
  }
  if (write && rule_ != nullptr) {
    if (const AbortCode why = rule_->may_write(passage.node, address, value, now_);
        why != AbortCode::none) {
      note_not_permitted(events_, counters_, passage.source, passage.target(), why, now_);
      return why;
    }
  }
  // The client repeats a transfer that was lost, as with the device itself.
  const bool taken = arbiter_.submit({.owner = this,
                                      .number = numbers_ + 1,
                                      .group = passage.from,
                                      .node = passage.node,
                                      .address = address,
                                      .write = write,
                                      .data = {value.begin(), value.end()},
                                      .timeout = line_.sdo_timeout,
                                      .priority = sdo::Priority::routing,
                                      .client = passage.client,
                                      .options = {.longest = ValueServer::kLongest}},
                                     now_);
  if (!taken) {
    return AbortCode::sdo_connection;
  }
  passage.number = ++numbers_;
  passage.times.begin_request(now_ + channel_wait(config_, line_.sdo_timeout), now_);
  passage.asked = address;
  passage.writes = write;
  wake_ = earlier(wake_, passage.times.wake(passage.server));
  return AbortCode::none;
}

void UsdoEgress::withdraw(Passage& passage) {
  if (passage.number != 0) {
    report_unknown(passage);
    arbiter_.cancel(*this, passage.node, std::exchange(passage.number, 0));
  }
  passage.times.restart_at = kNever;
}

// Nobody will see whether the device has written the value.
void UsdoEgress::report_unknown(const Passage& passage) {
  if (passage.writes && arbiter_.may_be_carried_out(*this, passage.node, passage.number)) {
    events_.emit({.time = now_,
                  .data = event::RoutingUnanswered{.source = passage.source,
                                                   .target = passage.network,
                                                   .index = passage.asked.index,
                                                   .sub = passage.asked.sub,
                                                   .target_node = passage.node,
                                                   .interface = config_.interface}});
  }
}

void UsdoEgress::completed(sdo::Completion& completion, Instant now) {
  now_ = now;
  const auto found = std::ranges::find_if(
      passages_, [&](const auto& each) { return each->number == completion.number; });
  if (found != passages_.end()) {  // else it was withdrawn
    (*found)->number = 0;
    finish(**found, completion.abort, completion.data, now);
    wake_ = earlier(wake_, now);  // makes the line hand on the answer
  }
}

void UsdoEgress::finish(Passage& passage, AbortCode why, std::span<const std::byte> value,
                        Instant now) {
  passage.times.end_request(now + client_timeout());
  passage.server.finish(why, value, now);
  pump(passage);
}

// --- the end ------------------------------------------------------------------------------------

void UsdoEgress::break_down(Passage& passage, AbortCode why) {
  (void)post_.send(to_connection(MessageKind::sdo_refused, passage.from, passage.connection,
                                 static_cast<std::uint32_t>(why)));
  release(passage);
}

void UsdoEgress::release(Passage& passage) {
  passage.server.reset();  // withdraws the request under way
  LINEGATE_ASSERT(passage.number == 0, "no request without a connection");
  passage.is_open = false;
  passage.times = {};
  --counters_.channels;
}

void UsdoEgress::stop(Instant now) {
  now_ = now;
  for (const auto& each : passages_) {
    if (each->is_open && each->number != 0) {
      const bool unknown = arbiter_.may_be_carried_out(*this, each->node, each->number);
      withdraw(*each);
      finish(*each, unknown ? AbortCode::timeout : AbortCode::device_state, {}, now);
    }
    if (each->is_open) {
      break_down(*each, AbortCode::device_state);
    }
  }
}

// --- time ---------------------------------------------------------------------------------------

Duration UsdoEgress::client_timeout() const {
  return client_frame_timeout(config_, line_.sdo_timeout);
}

void UsdoEgress::advance(Instant now) {
  now_ = now;
  if (now >= wake_) {
    wake_ = kNever;
    const Instant next = advance_passages(passages_, *this, now);
    wake_ = earlier(wake_, next);
  }
}

// No response is due while the device, or the arbiter, has the request.
void UsdoEgress::keep_waiting(Passage& passage) {
  passage.times.restart_at = now_ + restart_period(client_timeout(), kMostUsdoRestart);
  (void)post_.send(to_connection(MessageKind::sdo_paced, passage.from, passage.connection, 0));
}

// A transfer that has begun ends by itself: the time-out of the arbiter is for each answer.
void UsdoEgress::expire(Passage& passage) {
  if (passage.number == 0) {
    break_down(passage, AbortCode::timeout);
  } else if (!arbiter_.permits(passage.client)) {
    passage.times.deadline = now_ + channel_wait(config_, line_.sdo_timeout);
  } else if (arbiter_.withdraw(*this, passage.node, passage.number)) {
    passage.number = 0;
    finish(passage, AbortCode::sdo_connection, {}, now_);
  } else {
    passage.times.deadline = kNever;
  }
}

}  // namespace linegate::routing
