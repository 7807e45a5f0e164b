// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/arbiter.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"
#include "stack/sdo/client.h"
#include "stack/sdo/double_answers.h"
#include "stack/sdo/protocol.h"
#include "stack/sdo/request_queue.h"

namespace linegate::sdo {

namespace {

constexpr od::Address kProducerHeartbeatTime{od::objects::kProducerHeartbeatTime, 0};

}  // namespace

// The client side of one node's default server.
struct Arbiter::Channel {
  Channel(std::uint8_t id, std::unique_ptr<TransferClient> of_node)
      : node(id), client(std::move(of_node)), queue(kQueueLength) {}

  std::uint8_t node;
  std::unique_ptr<TransferClient> client;
  RequestQueue queue;
  std::optional<Request> current;        // the transfer under way
  std::optional<Instant> foreign_heard;  // last frame of another client
  Instant begun{};                       // start of the current transfer
  DoubleAnswers doubles;
  std::uint16_t written_producer_time = 0;  // 1017h, as written by the current transfer
  std::uint16_t producer_time = 0;          // 1017h as last confirmed or read; 0 = unknown
};

Arbiter::Arbiter(can::Dispatch& dispatch, can::TransmitQueue& transmit, EventLog& events)
    : dispatch_(dispatch), transmit_(transmit), events_(events) {
  block_from_.fill(TransferOptions{}.block_from);
}

Arbiter::~Arbiter() {
  LINEGATE_ASSERT(
      ended_.empty() &&
          std::ranges::all_of(used_, [this](std::uint8_t node) { return load(node) == 0; }),
      "the owners of SDO requests are gone before the arbiter");
}

Duration Arbiter::timeout_of(const Request& request) const {
  if (!request.write || request.user != nullptr) {
    return request.timeout;
  }
  switch (request.address.index) {
    case od::objects::kStoreParameters:
      return std::max(request.timeout, save_timeout_);
    case od::objects::kRestoreDefaults:
      return std::max(request.timeout, load_timeout_);
    default:
      return request.timeout;
  }
}

void Arbiter::set_block_from(std::uint8_t node, std::uint32_t bytes) {
  if (node <= can::kMaxNodeId) {
    block_from_[node] = bytes;
  }
}

bool Arbiter::submit(Request request, Instant now) {
  LINEGATE_ASSERT((request.owner != nullptr) != (request.user != nullptr),
                  "an SDO request has one owner");
  if (request.node < can::kMinNodeId || request.node > can::kMaxNodeId ||
      request.timeout <= Duration::zero() || (make_client_ && request.user != nullptr)) {
    return false;
  }
  now_ = std::max(now_, now);
  request.timeout = timeout_of(request);
  request.options.block_from = block_from_[request.node];
  Channel& target = channel(request.node);
  RequestOwner* const owner = RequestQueue::owner(request);
  if (!target.queue.push(std::move(request))) {
    return false;
  }
  ++owner->open_;
  serve(target, now);
  return true;
}

void Arbiter::receive(const can::Target& target, const can::Frame& frame) {
  Channel* addressed = channels_[target.index & can::kMaxNodeId].get();
  if (addressed == nullptr) {
    return;
  }
  now_ = std::max(now_, frame.time);
  if ((target.index & kForeignRequest) != 0) {
    addressed->client->expect_stray();
    addressed->doubles.disturb(frame.time);
    addressed->producer_time = 0;  // the other client may write it
    foreign(*addressed, frame);
  } else {
    response(*addressed, frame);
  }
}

void Arbiter::advance(Instant now) {
  now_ = std::max(now_, now);
  if (now < wake_) {
    return;
  }
  wake_ = kNever;
  // The first channel fills the free space of the queue: rotate, so that each channel is first
  // once.
  std::rotate(used_.begin(), used_.begin() + (used_.empty() ? 0 : 1), used_.end());
  for (const std::uint8_t node : used_) {
    Channel& each = *channels_[node];
    each.client->advance(now, transmit_);
    serve(each, now);
  }
}

void Arbiter::deliver_completions(Instant now) {
  LINEGATE_ASSERT(!delivering_, "no owner delivers SDO completions from within completed()");
  delivering_ = true;
  while (!ended_.empty()) {
    Ended next = std::move(ended_.front());
    ended_.pop_front();
    --next.owner->open_;
    next.owner->completed(next.completion, now);
  }
  delivering_ = false;
}

void Arbiter::cancel(const TransferOwner& owner, std::uint8_t node, std::uint64_t number) {
  if (node > can::kMaxNodeId || channels_[node] == nullptr) {
    return;
  }
  Channel& each = *channels_[node];
  Request waiting;
  if (is_current(each, owner, number)) {
    cancel_running(each, AbortCode::general);
  } else if (each.queue.remove(owner, number, waiting)) {
    complete(waiting, AbortCode::general);
  }
}

bool Arbiter::withdraw(TransferOwner& owner, std::uint8_t node, std::uint64_t number) {
  Request waiting;
  if (node > can::kMaxNodeId || channels_[node] == nullptr ||
      !channels_[node]->queue.remove(owner, number, waiting)) {
    return false;
  }
  --owner.open_;
  count(AbortCode::sdo_connection);
  return true;
}

bool Arbiter::may_be_carried_out(const TransferOwner& owner, std::uint8_t node,
                                 std::uint64_t number) const {
  return node <= can::kMaxNodeId && channels_[node] != nullptr &&
         is_current(*channels_[node], owner, number) &&
         channels_[node]->client->may_be_carried_out();
}

void Arbiter::disown(RequestOwner& owner) {
  for (const std::uint8_t node : used_) {
    Channel& each = *channels_[node];
    if (each.current && RequestQueue::owner(*each.current) == &owner) {
      abort_running(each, AbortCode::general);
      count(AbortCode::general);
    }
    const std::size_t waiting = each.queue.remove_all(owner);
    counters_.aborts += waiting;
  }
  std::erase_if(ended_, [&](const Ended& ended) { return ended.owner == &owner; });
  owner.open_ = 0;
}

Duration Arbiter::producer_time(std::uint8_t node) const {
  const bool known = node <= can::kMaxNodeId && channels_[node] != nullptr;
  return std::chrono::milliseconds(known ? channels_[node]->producer_time : 0);
}

void Arbiter::forget_producer_time(std::uint8_t node) {
  if (node <= can::kMaxNodeId && channels_[node] != nullptr) {
    channels_[node]->producer_time = 0;
  }
}

std::size_t Arbiter::load(std::uint8_t node) const {
  if (node > can::kMaxNodeId || channels_[node] == nullptr) {
    return 0;
  }
  const Channel& each = *channels_[node];
  return each.queue.size() + (each.current ? 1 : 0);
}

Arbiter::Channel& Arbiter::channel(std::uint8_t node) {
  LINEGATE_ASSERT(node >= can::kMinNodeId && node <= can::kMaxNodeId, "the node-ID is 1..127");
  std::unique_ptr<Channel>& place = channels_[node];
  if (place == nullptr) {
    place = std::make_unique<Channel>(node, make_client_ ? make_client_(node) : make_sdo(node));
    used_.push_back(node);
    dispatch_.add(can::kSdoResponseBase + node, false, can::Service::sdo_client, node);
    if (make_client_) {
      return *place;  // 600h + node-ID has the requests of that node, not those to it
    }
    dispatch_.add(can::kSdoRequestBase + node, false, can::Service::sdo_client,
                  static_cast<std::uint16_t>(kForeignRequest | node));
  }
  return *place;
}

std::unique_ptr<TransferClient> Arbiter::make_sdo(std::uint8_t node) const {
  auto client = std::make_unique<Client>(can::CobId{can::kSdoRequestBase + node});
  if (under_way_ != nullptr) {
    client->follow(*under_way_, node);
  }
  return client;
}

// Queues the completion of an ended transfer, starts the next request, and updates wake_.
void Arbiter::serve(Channel& channel, Instant now) {
  if (std::optional<Outcome> outcome = channel.client->take(); outcome && channel.current) {
    if (outcome->abort != AbortCode::none) {
      if (!outcome->refused) {
        channel.doubles.disturb(now);
      }
      report_abort(*channel.current, outcome->abort, now);
    } else if (channel.current->address == kProducerHeartbeatTime) {
      channel.producer_time = channel.current->write ? channel.written_producer_time
                              : outcome->data.size() == 2
                                  ? load_le<std::uint16_t>(outcome->data.data())
                                  : std::uint16_t{0};
    }
    complete(*channel.current, outcome->abort, std::move(outcome->data), outcome->refused);
    channel.current.reset();
  }
  Request next;
  if (!channel.current && channel.queue.pop(next, pace_)) {
    channel.current = std::move(next);
    begin(channel, now);
  }
  if (!channel.current && !channel.queue.empty()) {
    wake_ = earlier(wake_, now + Outbox::kRetry);  // the pace does not permit any of them
  }
  if (pace_ != nullptr && channel.current && channel.current->client != 0) {
    channel.client->set_awaited(channel.queue.has_other(channel.current->client, *pace_));
  }
  wake_ = earlier(wake_, channel.client->next_wake());
}

// Starts the current request. A user may already release the channel within granted().
void Arbiter::begin(Channel& channel, Instant now) {
  LINEGATE_ASSERT(channel.current && !channel.client->busy(),
                  "a server has one transfer at a time");
  Request& request = *channel.current;
  channel.begun = now;
  if (request.write && request.address == kProducerHeartbeatTime) {
    channel.producer_time = 0;
    channel.written_producer_time =
        request.data.size() == 2 ? load_le<std::uint16_t>(request.data.data()) : std::uint16_t{0};
  }
  channel.client->set_pace(request.client != 0 ? pace_ : nullptr, request.client);
  if (request.user != nullptr) {
    request.user->granted(request.number, now);
  } else if (request.write && request.source != nullptr) {
    channel.client->write(request.address, *request.source, request.timeout, now, transmit_,
                          request.options);
  } else if (!request.write && request.sink != nullptr) {
    channel.client->read(request.address, *request.sink, request.timeout, now, transmit_,
                         request.options);
  } else if (request.write) {
    channel.client->write(request.address, std::move(request.data), request.timeout, now, transmit_,
                          request.options);
  } else {
    channel.client->read(request.address, request.timeout, now, transmit_, request.options);
  }
}

// Returns true if the frame is a second answer to a request that was already answered.
bool Arbiter::look_for_twin(Channel& channel, const can::Frame& frame) {
  if (channel.current && channel.current->user != nullptr) {
    channel.doubles.forget();  // the requests of a ChannelUser are not examined
    return false;
  }
  if (make_client_ || !well_formed(frame)) {
    return false;
  }
  if (channel.current && frame.time - channel.begun >= channel.current->timeout) {
    channel.doubles.disturb(frame.time);  // the request may have been repeated
  }
  const std::uint64_t word = word_of(frame);
  const od::Address object = multiplexer(word);
  const bool asked =
      channel.current && channel.current->address == object && channel.client->waits_for_initiate();
  const auto found = channel.doubles.response(word, asked, frame.time);
  if (found == DoubleAnswers::Found::two_devices) {
    events_.emit({.time = frame.time,
                  .node = channel.node,
                  .data = event::SharedNodeId{.evidence = event::SharedIdEvidence::two_responses,
                                              .sub = object.sub,
                                              .index = object.index}});
  }
  return found != DoubleAnswers::Found::nothing;
}

void Arbiter::response(Channel& channel, const can::Frame& frame) {
  const bool second_answer = look_for_twin(channel, frame);
  if (channel.current && channel.current->user != nullptr && well_formed(frame)) {
    channel.current->user->response(channel.current->number, frame);
    return;
  }
  channel.client->count_received({frame.id, frame.length, frame.flags});
  switch (channel.client->receive(frame, transmit_)) {
    case Receipt::used:
      serve(channel, frame.time);
      break;
    case Receipt::stray:
      ++counters_.strays;
      // A request may have waited for this answer.
      wake_ = earlier(wake_, channel.client->next_wake());
      break;
    case Receipt::unasked:
      ++counters_.strays;
      wake_ = earlier(wake_, channel.client->next_wake());
      if (!second_answer) {
        foreign(channel, frame);
      }
      break;
    case Receipt::elsewhere:
      break;
    case Receipt::malformed:
      ++counters_.malformed;
      report_malformed(frame, channel.node, events_);
      break;
  }
}

void Arbiter::foreign(Channel& channel, const can::Frame& frame) {
  ++counters_.foreign;
  const bool quiet = !channel.foreign_heard || frame.time - *channel.foreign_heard >= kForeignQuiet;
  channel.foreign_heard = frame.time;
  if (quiet) {
    events_.emit({.time = frame.time, .node = channel.node, .data = event::ForeignSdo{frame.id}});
  }
}

void Arbiter::release(ChannelUser& user, std::uint8_t node, std::uint64_t number,
                      od::Address address, AbortCode outcome, Instant now) {
  now_ = std::max(now_, now);
  if (node > can::kMaxNodeId || channels_[node] == nullptr) {
    return;
  }
  Channel& each = *channels_[node];
  Request waiting;
  if (each.queue.remove(user, number, waiting)) {
    --user.open_;
    count(outcome);
    return;
  }
  if (!is_current(each, user, number)) {
    return;
  }
  --user.open_;
  each.current->address = address;
  each.producer_time = 0;  // its user may have written 1017h
  if (outcome != AbortCode::none) {
    each.doubles.disturb(now_);
    each.client->expect_stray();  // the pending answer
    each.client->expect_stray();  // an abort by the server, if it times out too
    if (address != od::Address{}) {
      report_abort(*each.current, outcome, now_);
    }
  }
  count(outcome);
  each.current.reset();
  wake_ = earlier(wake_, now_);
}

void Arbiter::count(AbortCode abort) {
  if (abort == AbortCode::none) {
    ++counters_.transfers;
  } else {
    ++counters_.aborts;
    counters_.timeouts += abort == AbortCode::timeout ? 1 : 0;
  }
}

void Arbiter::complete(const Request& request, AbortCode abort, std::vector<std::byte> data,
                       bool refused) {
  count(abort);
  ended_.push_back({request.owner,
                    {.number = request.number,
                     .node = request.node,
                     .address = request.address,
                     .write = request.write,
                     .abort = abort,
                     .data = std::move(data),
                     .refused = refused}});
}

bool Arbiter::is_current(const Channel& channel, const RequestOwner& owner, std::uint64_t number) {
  return channel.current && RequestQueue::owner(*channel.current) == &owner &&
         channel.current->number == number;
}

// The next request starts in advance(), which is due at once: only there is the start of its
// time-out known.
void Arbiter::cancel_running(Channel& channel, AbortCode code) {
  complete(abort_running(channel, code), code);
}

Request Arbiter::abort_running(Channel& channel, AbortCode code) {
  LINEGATE_ASSERT(channel.current, "a request is under way");
  if (channel.client->waits_for_initiate()) {
    channel.doubles.cancel(channel.current->address, now_);
  }
  channel.client->abort(code, now_, transmit_);
  channel.client->take();
  wake_ = earlier(wake_, now_);
  return *std::exchange(channel.current, std::nullopt);
}

void Arbiter::report_abort(const Request& request, AbortCode code, Instant now) {
  if (request.priority != Priority::command && request.priority != Priority::routing) {
    return;
  }
  events_.emit({.time = now,
                .node = request.node,
                .data = event::SdoAbort{
                    .abort = code, .index = request.address.index, .sub = request.address.sub}});
}

}  // namespace linegate::sdo
