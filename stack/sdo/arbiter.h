// SPDX-License-Identifier: Apache-2.0
// Who may talk to a device's default SDO server next. One arbiter per line owns the client side of
// the 127 default channels (600h + node-ID, 580h + node-ID; CiA 301, 7.3.5): a default server
// serves one transfer at a time, so everybody who wants one queues here. Transfers with different
// nodes run at the same time.
//
// No other client of this process may use these identifiers: a node::Node beside the arbiter has
// Options::clients_of_default_servers off, so that its objects 1280h to 12FFh cannot.
//
// The order at a node is that of RequestQueue: priorities, owners in turns, nobody waits for ever.
//
// Somebody else who uses the same server (a request seen on 600h + node, or an answer to nobody) is
// told as EventKind::foreign_sdo, once per node until it has been quiet for 10 seconds. A command
// or route that ends with an abort is told as EventKind::sdo_abort; boot tells its own result, and
// a scan expects aborts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/sdo/request.h"
#include "stack/sdo/requests_under_way.h"

namespace linegate::sdo {

struct ArbiterCounters {
  std::uint64_t transfers = 0;  // ended well
  std::uint64_t aborts = 0;     // ended by an abort of either side, a time-out or a cancellation
  std::uint64_t timeouts = 0;   // of these, the server did not answer in time
  std::uint64_t strays = 0;     // answers that nobody waited for
  std::uint64_t foreign = 0;    // frames of somebody else's use
  std::uint64_t malformed = 0;  // frames on these channels that do not have 8 bytes
};

class Arbiter {
 public:
  static constexpr std::size_t kQueueLength = 64;         // requests waiting for a node
  static constexpr std::uint16_t kForeignRequest = 0x80;  // Target::index: flag of 600h + node-ID
  static constexpr Duration kForeignQuiet = std::chrono::seconds(10);

  // A node's identifiers are added to dispatch as Service::sdo_client when it is first used: 580h +
  // n with index n, 600h + n with index kForeignRequest | n. All must outlive the arbiter, which
  // outlives the owners of its requests.
  Arbiter(can::Dispatch& dispatch, can::TransmitQueue& transmit, EventLog& events);
  ~Arbiter();
  Arbiter(const Arbiter&) = delete;
  Arbiter& operator=(const Arbiter&) = delete;

  // Devices store their parameters, and restore them, before they answer: a write of 1010h or 1011h
  // waits for its answer at least that long, whatever Request::timeout says.
  void set_slow_writes(Duration save, Duration load) {
    save_timeout_ = save;
    load_timeout_ = load;
  }

  // Which requests were acknowledged on the bus, see Client::follow(); must outlive the arbiter.
  // Before the first request.
  void follow(const RequestsUnderWay& under_way) { under_way_ = &under_way; }

  // Transfers with the node go in blocks from so many bytes on; kNoBlocks: never. The default is
  // that of TransferOptions. No effect on node-IDs out of range.
  void set_block_from(std::uint8_t node, std::uint32_t bytes);

  // Precondition: either owner or user is set. False if the node's queue is full or node or timeout
  // is out of range: there will be no Completion then. Otherwise there will be exactly one, unless
  // the owner disowns it, but none for a ChannelUser. Never calls completed() itself.
  bool submit(Request request, Instant now);

  // A frame dispatched to Service::sdo_client; frame.time is now.
  void receive(const can::Target& target, const can::Frame& frame);
  void advance(Instant now);
  // Never later than the next time-out; may be earlier.
  Instant next_wake() const { return wake_; }

  // Calls TransferOwner::completed() for each transfer that has ended, the oldest first, also for
  // those that end meanwhile. Precondition: not called by completed().
  void deliver_completions(Instant now);

  // Ends the request with abort 0800 0000h, waiting or under way (then the server gets the abort);
  // there will be a Completion. No effect if the owner has none of the node with this number.
  void cancel(const TransferOwner& owner, std::uint8_t node, std::uint64_t number);
  // Cancels all requests of the owner; nothing of it will be called any more.
  void disown(RequestOwner& owner);
  // A ChannelUser needs the channel no more, or does not wait for it any longer. address and
  // outcome (none: all went well) are those of its transfer, 0000h:00 if there was none. Who waits
  // behind it is served by advance(), which is due at once. No effect if the number is not known.
  void release(ChannelUser& user, std::uint8_t node, std::uint64_t number, od::Address address,
               AbortCode outcome);

  // 1017h of the node as a transfer wrote or read it last; 0 if that is not known, or another
  // client was heard since.
  Duration producer_time(std::uint8_t node) const;
  // The node booted: it may have another one.
  void forget_producer_time(std::uint8_t node);
  // Requests waiting or under way for the node.
  std::size_t load(std::uint8_t node) const;
  const ArbiterCounters& counters() const { return counters_; }

 private:
  struct Channel;

  Duration timeout_of(const Request& request) const;
  Channel& channel(std::uint8_t node);
  void serve(Channel& channel, Instant now);
  void begin(Channel& channel, Instant now);
  void response(Channel& channel, const can::Frame& frame);
  bool look_for_twin(Channel& channel, const can::Frame& frame);
  void foreign(Channel& channel, const can::Frame& frame);
  void count(AbortCode abort);
  void complete(const Request& request, AbortCode abort, std::vector<std::byte> data = {},
                bool refused = false);
  void cancel_running(Channel& channel, AbortCode code);
  Request abort_running(Channel& channel, AbortCode code);
  static bool is_current(const Channel& channel, const RequestOwner& owner, std::uint64_t number);
  void tell_abort(const Request& request, AbortCode code, Instant now);

  can::Dispatch& dispatch_;
  can::TransmitQueue& transmit_;
  EventLog& events_;
  const RequestsUnderWay* under_way_ = nullptr;
  std::array<std::unique_ptr<Channel>, 128> channels_;  // by node-ID
  std::vector<std::uint8_t> used_;                      // node-IDs that have a channel
  // Of transfers that have ended.
  struct Ended {
    TransferOwner* owner = nullptr;
    Completion completion;
  };
  std::deque<Ended> ended_;
  bool delivering_ = false;
  std::array<std::uint32_t, 128> block_from_;  // by node-ID
  Duration save_timeout_{};
  Duration load_timeout_{};
  Instant wake_ = kNever;
  Instant now_{};  // newest time heard of
  ArbiterCounters counters_;
};

}  // namespace linegate::sdo
