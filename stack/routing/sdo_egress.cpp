// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/sdo_egress.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/routing/access.h"
#include "stack/routing/sdo_ingress.h"
#include "stack/sdo/protocol.h"
#include "stack/sdo/server.h"

namespace linegate::routing {
namespace {

// Bytes 0 to 4, which the gateway must echo
constexpr std::uint64_t kWhatIsEchoed = 0xFF'FFFF'FFFF;
// Queue of a server of the own node: more than it sends at once
constexpr std::uint32_t kPlaces = 48;
constexpr Duration kPacedPeriod = std::chrono::milliseconds(5);

// The own dictionary as the target: a server without a bus.
struct OwnServer {
  OwnServer(od::Dictionary& dictionary, EventLog& events)
      : server(dictionary, can::CobId{0}, can::CobId{0}, events) {}

  sdo::Server server;
  can::TransmitQueue queue{kPlaces};
};

// An abort of object 0000h:00; or of any object with 0504 0001h, by a server that does not support
// indications. Other aborts end an earlier transfer.
bool refuses_indication(std::uint64_t word) {
  return static_cast<std::uint8_t>(word) == sdo::command_byte(sdo::ServerCommand::abort) &&
         (sdo::multiplexer(word) == od::Address{} ||
          static_cast<AbortCode>(sdo::long_word(word)) == AbortCode::command_specifier);
}

}  // namespace

struct SdoEgress::Passage {
  enum class State : std::uint8_t { free, waiting, asking, open, draining };

  State state = State::free;
  std::uint8_t from = 0;     // interface of the ingress
  std::uint8_t node = 0;     // node-ID of the server: the target or the next gateway
  std::uint8_t channel = 0;  // number of the client SDO
  bool to_gateway = false;
  bool own = false;  // the target is the own node
  Permissions permitted;
  std::uint16_t source = 0;
  std::uint32_t connection = 0;
  std::uint32_t client = 0;  // whose command it is, see sdo::Pace; 0 = nobody's
  std::uint64_t number = 0;  // of its request to the arbiter
  Indication target;         // sent to the next gateway
  SdoPhase phase;
  AbortCode outcome = AbortCode::none;
  Instant deadline = kNever;
  Instant budget = kNever;            // end of the requester's wait for the route
  Instant paced_at = kNever;          // when the ingress is to receive sdo_paced
  WordQueue waiting;                  // frames that wait for room on the bus
  std::unique_ptr<OwnServer> server;  // kept for the next passage
};

SdoEgress::SdoEgress(const Config& config, Line line, od::Dictionary& own, sdo::Arbiter& arbiter,
                     can::TransmitQueue& transmit, Post& post, EventLog& events, Counters& counters)
    : config_(config),
      line_(line),
      own_(own),
      arbiter_(arbiter),
      transmit_(transmit),
      post_(post),
      events_(events),
      counters_(counters) {
}

SdoEgress::~SdoEgress() {
  arbiter_.disown(*this);
}

SdoEgress::Passage* SdoEgress::find(std::uint8_t from, std::uint32_t connection) const {
  for (const auto& each : passages_) {
    if (each->connection == connection && each->from == from &&
        each->state != Passage::State::free && each->state != Passage::State::draining) {
      return each.get();
    }
  }
  return nullptr;
}

SdoEgress::Passage* SdoEgress::find(std::uint64_t number) const {
  for (const auto& each : passages_) {
    if (each->number == number && each->state != Passage::State::free) {
      return each.get();
    }
  }
  return nullptr;
}

SdoEgress::Passage& SdoEgress::make(const Message& open) {
  auto place = std::find_if(passages_.begin(), passages_.end(),
                            [](const auto& each) { return each->state == Passage::State::free; });
  if (place == passages_.end()) {
    passages_.push_back(std::make_unique<Passage>());
    place = passages_.end() - 1;
  }
  Passage& made = **place;
  made.number = ++numbers_;
  made.from = open.from;
  made.connection = open.connection;
  made.source = open.source;
  made.client = client_of(open);
  made.target = {
      .network = open.network, .node = open.node, .hops = static_cast<std::uint8_t>(open.hops + 1)};
  made.to_gateway = open.gateway != 0;
  made.own = !made.to_gateway && (open.node == 0 || open.node == line_.node);
  made.node = made.to_gateway ? open.gateway : open.node;
  made.channel = 0;
  made.phase.reset();
  made.waiting.clear();
  made.deadline = kNever;
  made.paced_at = kNever;
  return made;
}

// --- opening ------------------------------------------------------------------------------------

void SdoEgress::deliver(const Message& message, Instant now) {
  if (message.kind == MessageKind::sdo_open) {
    open(message, now);
    return;
  }
  Passage* const passage = find(message.from, message.connection);
  if (passage == nullptr) {
    ++counters_.unexpected;
  } else if (message.kind == MessageKind::sdo_request) {
    request(*passage, word_of(message), now);
  } else {
    abort_server(*passage, abort_of(message), now);
    release(*passage, abort_of(message), now);
  }
}

void SdoEgress::open(const Message& message, Instant now) {
  if (find(message.from, message.connection) != nullptr) {
    ++counters_.unexpected;
    return;
  }
  const Permissions permitted = permissions(config_, message);
  if (permitted.none()) {
    refuse_entry(events_, counters_, post_, message, now);
    return;
  }
  if (!usable_) {
    (void)post_.send(refusal(message, AbortCode::device_state));
    return;
  }
  Passage& made = make(message);
  made.permitted = permitted;
  made.budget = budget(made, message.hops, now);
  if (const AbortCode why = reserve(made, now); why != AbortCode::none) {
    (void)post_.send(refusal(message, why));
  }
}

// There is one client SDO 1, whose COB-IDs are set to those of the target; the rule or the hook may
// provide more client SDOs.
AbortCode SdoEgress::reserve(Passage& passage, Instant now) {
  if (passage.own) {
    if (passage.server == nullptr) {
      passage.server = std::make_unique<OwnServer>(own_, events_);
    }
    ++counters_.channels;
    passage.state = Passage::State::waiting;
    opened(passage, now);
    return AbortCode::none;
  }
  const bool shared =
      config_.choose_channel == nullptr && config_.channels == ChannelRule::per_node;
  const std::uint8_t channel = config_.choose_channel != nullptr
                                   ? config_.choose_channel(passage.target.network, passage.node)
                                   : (shared ? passage.node : std::uint8_t{1});
  if (channel == 0 || (!shared && channels_taken_[channel])) {
    return AbortCode::sdo_connection;
  }
  passage.channel = shared ? std::uint8_t{0} : channel;
  channels_taken_[passage.channel] = passage.channel != 0;
  ++counters_.channels;
  passage.state = Passage::State::waiting;
  wait_until(passage, earlier(now + channel_wait(config_, line_.sdo_timeout), passage.budget));
  const bool taken = arbiter_.submit({.user = this,
                                      .number = passage.number,
                                      .group = passage.from,
                                      .node = passage.node,
                                      .priority = sdo::Priority::routing,
                                      .client = passage.client},
                                     now);
  if (!taken) {
    channels_taken_[std::exchange(passage.channel, std::uint8_t{0})] = false;
    --counters_.channels;
    passage.state = Passage::State::free;
    passage.deadline = kNever;
    return AbortCode::sdo_connection;
  }
  return AbortCode::none;
}

// Unlimited if no gateway waits: then only the client itself waits for the channel of the target.
Instant SdoEgress::budget(const Passage& passage, unsigned hops, Instant now) const {
  return passage.to_gateway || hops > 1
             ? now + gateway_timeout(config_, line_.sdo_timeout, passage.target.hops)
             : kNever;
}

void SdoEgress::granted(std::uint64_t number, Instant now) {
  Passage* const passage = find(number);
  if (passage == nullptr) {
    return;
  }
  if (!passage->to_gateway) {
    opened(*passage, now);
    return;
  }
  LINEGATE_ASSERT(passage->state == Passage::State::waiting, "the channel is waited for");
  passage->state = Passage::State::asking;
  wait_until(*passage, passage->budget);
  give(*passage, encode(passage->target), now);
}

void SdoEgress::opened(Passage& passage, Instant now) {
  LINEGATE_ASSERT(
      passage.state == Passage::State::waiting || passage.state == Passage::State::asking,
      "a passage opens once");
  passage.state = Passage::State::open;
  // A fallback in case the ingress, which has the arm timer, no longer exists.
  wait_until(passage, now + config_.arm_timeout + frame_timeout());
  (void)post_.send(to_connection(MessageKind::sdo_opened, passage.from, passage.connection, 0));
}

void SdoEgress::refuse(Passage& passage, AbortCode why, Instant now) {
  (void)post_.send(to_connection(MessageKind::sdo_refused, passage.from, passage.connection,
                                 static_cast<std::uint32_t>(why)));
  release(passage, why, now);
}

void SdoEgress::answered_by_gateway(Passage& passage, std::uint64_t word, Instant now) {
  if (((word ^ encode(passage.target)) & kWhatIsEchoed) == 0) {
    opened(passage, now);
  } else if (refuses_indication(word)) {
    refuse(passage, static_cast<AbortCode>(sdo::long_word(word)), now);
  }  // otherwise it answers an earlier transfer
}

// --- frames -------------------------------------------------------------------------------------

void SdoEgress::request(Passage& passage, std::uint64_t word, Instant now) {
  if (passage.state != Passage::State::open) {
    ++counters_.unexpected;
    return;
  }
  if (const AbortCode why = not_permitted(passage, word, now); why != AbortCode::none) {
    note_not_permitted(events_, counters_, passage.source, passage.target, why, now);
    abort_server(passage, AbortCode::general, now);
    (void)answer(passage, sdo::abort_word(sdo::multiplexer(word), why), now);
    release(passage, why, now);
    return;
  }
  wait_until(passage, now + frame_timeout());
  const SdoPhase::End end = passage.phase.request(word);
  passage.own ? serve_own(passage, word, now) : give(passage, word, now);
  if (end != SdoPhase::End::none && passage.state == Passage::State::open) {
    release(passage, end == SdoPhase::End::finished ? AbortCode::none : AbortCode::general, now);
  }
}

AbortCode SdoEgress::not_permitted(const Passage& passage, std::uint64_t word, Instant now) const {
  if (passage.phase.in_sub_block() || !SdoPhase::initiates(word)) {
    return AbortCode::none;
  }
  const AbortCode why = passage.permitted.refusal(word);
  return why == AbortCode::none && SdoPhase::writes(word) ? refused_by_rule(passage, word, now)
                                                          : why;
}

AbortCode SdoEgress::refused_by_rule(const Passage& passage, std::uint64_t word,
                                     Instant now) const {
  if (rule_ == nullptr || passage.to_gateway || passage.own) {
    return AbortCode::none;
  }
  const auto command = static_cast<std::uint8_t>(word);
  const bool is_expedited = !sdo::is_block_send(command) && (command & sdo::kExpedited) != 0;
  std::array<std::byte, sdo::kExpeditedSize> value{};
  store_le(value.data(), sdo::long_word(word));
  return rule_->may_write(passage.node, sdo::multiplexer(word),
                          std::span(value).first(is_expedited ? sdo::expedited_size(command) : 0),
                          now);
}

void SdoEgress::response(std::uint64_t number, const can::Frame& frame) {
  Passage* const passage = find(number);
  if (passage == nullptr || passage->state == Passage::State::draining) {
    return;
  }
  arbiter_.charge(passage->client, 1);
  const std::uint64_t word = sdo::word_of(frame);
  if (passage->state == Passage::State::asking) {
    answered_by_gateway(*passage, word, frame.time);
    return;
  }
  const bool stray = !passage->phase.under_way() || (passage->phase.awaits_first_answer() &&
                                                     !passage->phase.is_first_answer(word));
  if (stray) {
    return;  // an answer to an earlier request
  }
  wait_until(*passage, frame.time + frame_timeout());
  if (!answer(*passage, word, frame.time)) {
    abort_server(*passage, AbortCode::out_of_memory, frame.time);
    release(*passage, AbortCode::out_of_memory, frame.time);
  }
}

// False if there is no room on the way back.
bool SdoEgress::answer(Passage& passage, std::uint64_t word, Instant now) {
  const SdoPhase::End end = passage.phase.response(word);
  if (!post_.send(
          to_connection(MessageKind::sdo_response, passage.from, passage.connection, word))) {
    return false;
  }
  if (end != SdoPhase::End::none) {
    const auto code = static_cast<AbortCode>(sdo::long_word(word));
    release(passage, end == SdoPhase::End::finished ? AbortCode::none : code, now);
  }
  return true;
}

void SdoEgress::serve_own(Passage& passage, std::uint64_t word, Instant now) {
  can::Frame frame;
  frame.length = sdo::kFrameSize;
  frame.time = now;
  store_le(frame.data.data(), word);
  passage.server->server.receive(frame, passage.server->queue);
  pump_own(passage, now);
}

void SdoEgress::pump_own(Passage& passage, Instant now) {
  can::Frame frame;
  while (passage.state == Passage::State::open && passage.server->queue.pop(frame)) {
    wait_until(passage, now + frame_timeout());
    if (!answer(passage, sdo::word_of(frame), now)) {
      break_down(passage, AbortCode::out_of_memory, now);
    }
  }
  if (passage.state == Passage::State::open) {
    wake_ = earlier(wake_, passage.server->server.next_wake());
  }
}

void SdoEgress::give(Passage& passage, std::uint64_t word, Instant now) {
  if (passage.waiting.empty() && put_on_bus(passage, word)) {
    return;
  }
  if (!passage.waiting.push(word)) {
    break_down(passage, AbortCode::out_of_memory, now);
    return;
  }
  note_waiting(passage, now);
}

// Only a few frames may wait in the transmit queue, so that requests of other users are not
// delayed.
bool SdoEgress::put_on_bus(const Passage& passage, std::uint64_t word) {
  constexpr auto kSdo = can::TransmitClass::sdo;
  return transmit_.queued(kSdo) < sdo::Outbox::kMany && arbiter_.permits(passage.client) &&
         push(passage, word);
}

// Frames wait. No answer is due while they wait for the share of the client: the ingress learns it
// often enough for the shortest time-out, and not with every frame.
void SdoEgress::note_waiting(Passage& passage, Instant now) {
  wake_ = earlier(wake_, now + WordQueue::kRetry);
  if (arbiter_.permits(passage.client) || passage.state != Passage::State::open) {
    return;
  }
  wait_until(passage, now + frame_timeout());
  if (passage.paced_at == kNever || now >= passage.paced_at) {
    passage.paced_at = now + kPacedPeriod;
    (void)post_.send(to_connection(MessageKind::sdo_paced, passage.from, passage.connection, 0));
  }
}

bool SdoEgress::push(const Passage& passage, std::uint64_t word) {
  constexpr auto kSdo = can::TransmitClass::sdo;
  if (transmit_.room(kSdo) == 0) {
    return false;
  }
  const can::CobId request{can::kSdoRequestBase + passage.node};
  ++counters_.forwarded;
  arbiter_.charge(passage.client, 1);
  return transmit_.push(kSdo, request.header(sdo::kFrameSize), word);
}

void SdoEgress::flush(Passage& passage, Instant now) {
  while (!passage.waiting.empty()) {
    if (!put_on_bus(passage, passage.waiting.front())) {
      note_waiting(passage, now);
      return;
    }
    passage.waiting.pop();
  }
}

// --- the end ------------------------------------------------------------------------------------

void SdoEgress::break_down(Passage& passage, AbortCode why, Instant now) {
  (void)post_.send(to_connection(MessageKind::sdo_refused, passage.from, passage.connection,
                                 static_cast<std::uint32_t>(why)));
  abort_server(passage, why, now);
  release(passage, why, now);
}

// Waiting frames are obsolete. A next gateway gets the abort in any state, because it has reserved
// the rest of the route.
void SdoEgress::abort_server(Passage& passage, AbortCode why, Instant /*now*/) {
  const bool asked = passage.state == Passage::State::asking ||
                     (passage.state == Passage::State::open && passage.to_gateway);
  if (passage.own || (!asked && !passage.phase.under_way())) {
    return;
  }
  passage.waiting.clear();
  const std::uint64_t word = sdo::abort_word(passage.phase.address(), why);
  if (!put_on_bus(passage, word)) {
    (void)passage.waiting.push(word);
  }
}

void SdoEgress::release(Passage& passage, AbortCode outcome, Instant now) {
  if (passage.state == Passage::State::free || passage.state == Passage::State::draining) {
    return;
  }
  passage.deadline = kNever;
  if (passage.own) {
    passage.state = Passage::State::free;
    --counters_.channels;
    passage.server->server.reset();
    passage.server->queue.clear();
    return;
  }
  passage.state = Passage::State::draining;
  passage.outcome = outcome;
  while (!passage.waiting.empty() && push(passage, passage.waiting.front())) {
    passage.waiting.pop();
  }
  if (passage.waiting.empty()) {
    finish(passage, now);
  } else {
    wake_ = Instant{};  // makes advance() due, which has the time
  }
}

// Frames that the bus does not accept within the frame time-out of a server are lost.
void SdoEgress::drain(Passage& passage, Instant now) {
  while (!passage.waiting.empty() && push(passage, passage.waiting.front())) {
    passage.waiting.pop();
  }
  if (passage.waiting.empty()) {
    finish(passage, now);
  } else if (passage.deadline == kNever) {
    wait_until(passage, now + frame_timeout());
  } else if (now >= passage.deadline) {
    finish(passage, now);
  }
  if (passage.state == Passage::State::draining) {
    wake_ = earlier(wake_, now + WordQueue::kRetry);
  }
}

void SdoEgress::finish(Passage& passage, Instant now) {
  LINEGATE_ASSERT(passage.state == Passage::State::draining, "only the bus is waited for");
  counters_.lost += passage.waiting.size();
  passage.waiting.clear();
  passage.state = Passage::State::free;
  passage.deadline = kNever;
  --counters_.channels;
  channels_taken_[std::exchange(passage.channel, std::uint8_t{0})] = false;
  arbiter_.release(*this, passage.node, passage.number, passage.phase.address(), passage.outcome,
                   now);
}

// --- time ---------------------------------------------------------------------------------------

void SdoEgress::wait_until(Passage& passage, Instant deadline) {
  passage.deadline = deadline;
  wake_ = earlier(wake_, deadline);
}

Duration SdoEgress::frame_timeout() const {
  return config_.frame_timeout > Duration::zero() ? config_.frame_timeout : 2 * line_.sdo_timeout;
}

// A server of the own dictionary may wait for a hook, which can finish before the deadline.
Instant SdoEgress::next_wake() const {
  Instant wake = wake_;
  for (const auto& passage : passages_) {
    if (passage->own && passage->state == Passage::State::open) {
      wake = earlier(wake, passage->server->server.next_wake());
    }
  }
  return wake;
}

void SdoEgress::advance(Instant now) {
  if (now < next_wake()) {
    return;
  }
  wake_ = kNever;
  for (const auto& each : passages_) {
    Passage& passage = *each;
    if (passage.state == Passage::State::free) {
      continue;
    }
    if (passage.state == Passage::State::draining) {
      drain(passage, now);
      wake_ = earlier(wake_, passage.deadline);
      continue;
    }
    flush(passage, now);
    if (passage.own && now >= passage.server->server.next_wake()) {
      passage.server->server.advance(now, passage.server->queue);
      pump_own(passage, now);
    }
    if (now >= passage.deadline) {
      expire(passage, now);
    }
    wake_ = earlier(wake_, passage.deadline);
    if (passage.own && passage.state == Passage::State::open) {
      wake_ = earlier(wake_, passage.server->server.next_wake());
    }
  }
}

void SdoEgress::expire(Passage& passage, Instant now) {
  switch (passage.state) {
    case Passage::State::waiting:
      refuse(passage, AbortCode::sdo_connection, now);
      return;
    case Passage::State::asking:
      abort_server(passage, AbortCode::timeout, now);
      refuse(passage, AbortCode::timeout, now);
      return;
    default:
      break_down(passage, AbortCode::timeout, now);
      return;
  }
}

void SdoEgress::stop(Instant now) {
  for (const auto& each : passages_) {
    if (each->state != Passage::State::free && each->state != Passage::State::draining) {
      const bool passed_on = each->waiting.empty();
      break_down(*each, passed_on ? each->phase.stop_code() : AbortCode::device_state, now);
    }
  }
}

}  // namespace linegate::routing
