// SPDX-License-Identifier: Apache-2.0
// Schedules all transfers with the default SDO servers of a line. One arbiter per line owns the
// client side of the 127 default channels (600h + node-ID, 580h + node-ID; CiA 301, 7.3.5): a
// default server serves one transfer at a time, so all clients of this process queue here.
// Transfers with different nodes run at the same time.
//
// No other client of this process may use these identifiers: a node::Node beside the arbiter has
// Options::clients_of_default_servers off, so that its objects 1280h to 12FFh cannot.
//
// The order at a node is that of RequestQueue: by priority, owners in turns, without starvation. A
// request whose client exceeds its share of the bus does not occupy the server until its first
// frame may be sent; a transfer that has begun occupies it until its end, however slowly its client
// may continue: CANopen has no way to interrupt and resume one (CiA 301 7.2.4.3). Pace::permits()
// may let it end earlier while others wait for it.
//
// Use of a server by another client (a request on 600h + node, or an answer without a request) is
// reported as EventKind::foreign_sdo, once per node until no such frame was received for 10
// seconds. A command or route that ends with an abort is reported as EventKind::sdo_abort; the boot
// process reports its own result, and a scan expects aborts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/sdo/pace.h"
#include "stack/sdo/request.h"
#include "stack/sdo/requests_under_way.h"
#include "stack/sdo/transfer_client.h"

namespace linegate::sdo {

struct ArbiterCounters {
  std::uint64_t transfers = 0;  // ended without an error
  std::uint64_t aborts = 0;     // ended by an abort of either side, a time-out or a cancellation
  std::uint64_t timeouts = 0;   // of these aborts: the server did not answer in time
  std::uint64_t strays = 0;     // answers that do not belong to the current request
  std::uint64_t foreign = 0;    // frames to or from another client
  std::uint64_t malformed = 0;  // frames on these channels whose length is not 8 bytes
};

class Arbiter {
 public:
  static constexpr std::size_t kQueueLength = 64;         // requests waiting for a node
  static constexpr std::uint16_t kForeignRequest = 0x80;  // Target::index: flag of 600h + node-ID
  static constexpr Duration kForeignQuiet = std::chrono::seconds(10);

  // When a node is first used, its identifiers are added to dispatch as Service::sdo_client: 580h +
  // n with index n, 600h + n with index kForeignRequest | n. All must outlive the arbiter, which
  // outlives the owners of its requests.
  Arbiter(can::Dispatch& dispatch, can::TransmitQueue& transmit, EventLog& events);
  ~Arbiter();
  Arbiter(const Arbiter&) = delete;
  Arbiter& operator=(const Arbiter&) = delete;

  // The channels have another protocol than SDO: those of CANopen FD. make is called when a node is
  // first used, and its clients receive the frames on 580h + node-ID. Several clients may use a
  // server then, so that others are not foreign, and no ChannelUser can have a channel. Call it
  // before the first request.
  void set_clients(MakeClient make) { make_client_ = std::move(make); }

  // Least time-outs of a write of 1010h (save) and 1011h (load), which override a shorter
  // Request::timeout: a device may store or restore its parameters before it answers.
  void set_slow_writes(Duration save, Duration load) {
    save_timeout_ = save;
    load_timeout_ = load;
  }

  // under_way states which requests were acknowledged on the bus, see Client::follow(); it must
  // outlive the arbiter. Call it before the first request.
  void follow(const RequestsUnderWay& under_way) { under_way_ = &under_way; }

  // Limits the frames of requests with a client from now on; pace must outlive the arbiter.
  void set_pace(Pace& pace) { pace_ = &pace; }
  // Frames that a command of that client caused beside SDO transfers, see Pace; 0: nobody's.
  bool permits(std::uint32_t client) const {
    return pace_ == nullptr || client == 0 || pace_->permits(client, false);
  }
  void charge(std::uint32_t client, unsigned frames) {
    for (; pace_ != nullptr && client != 0 && frames > 0; --frames) {
      pace_->count(client);
    }
  }

  // Values of at least `bytes` bytes are transferred in blocks with this node; kNoBlocks: never.
  // The default is that of TransferOptions. No effect if the node-ID is out of range.
  void set_block_from(std::uint8_t node, std::uint32_t bytes);

  // Precondition: either owner or user is set. Returns false, and there will be no Completion, if
  // the node's queue is full, or node or timeout is out of range. Otherwise a transfer gets exactly
  // one Completion unless its owner disowns it; a ChannelUser gets none. Never calls completed()
  // itself.
  bool submit(Request request, Instant now);

  // Processes a frame dispatched to Service::sdo_client at frame.time.
  void receive(const can::Target& target, const can::Frame& frame);
  void advance(Instant now);
  // Never later than the next time-out; may be earlier.
  Instant next_wake() const { return wake_; }

  // Calls TransferOwner::completed() for each transfer that has ended, in order of their ends,
  // including those that end within such a call. Precondition: not called by completed().
  void deliver_completions(Instant now);

  // Ends a waiting request or the current transfer with abort 0800 0000h, which is sent to the
  // server in the latter case; there will be a Completion. No effect if the owner has no request
  // with this number at the node.
  void cancel(const TransferOwner& owner, std::uint8_t node, std::uint64_t number);
  // Removes a request that still waits for its server; there will be no Completion. False, without
  // an effect, if it is under way, has ended, or does not exist.
  bool withdraw(TransferOwner& owner, std::uint8_t node, std::uint64_t number);
  // The request with this number is a write that its server may have carried out, because all of it
  // was sent, see Client::may_be_carried_out(). false for a request that waits, or has ended.
  bool may_be_carried_out(const TransferOwner& owner, std::uint8_t node,
                          std::uint64_t number) const;
  // Cancels all requests of the owner; it is not called any more.
  void disown(RequestOwner& owner);
  // The ChannelUser releases its channel, or withdraws its request for it. address and outcome
  // (none = success) are those of its transfer; 0000h:00 if there was none. The next request is
  // started by advance(), which is due at once. No effect if the number is unknown.
  void release(ChannelUser& user, std::uint8_t node, std::uint64_t number, od::Address address,
               AbortCode outcome, Instant now);

  // 1017h of the node as a transfer wrote or read it last; 0 if it is unknown, or another client
  // was observed since.
  Duration producer_time(std::uint8_t node) const;
  // Call it when the node has booted: 1017h may have changed.
  void forget_producer_time(std::uint8_t node);
  // Number of requests for the node, waiting or under way.
  std::size_t load(std::uint8_t node) const;
  const ArbiterCounters& counters() const { return counters_; }

 private:
  struct Channel;

  Duration timeout_of(const Request& request) const;
  std::unique_ptr<TransferClient> make_sdo(std::uint8_t node) const;
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
  void report_abort(const Request& request, AbortCode code, Instant now);

  can::Dispatch& dispatch_;
  can::TransmitQueue& transmit_;
  EventLog& events_;
  MakeClient make_client_;  // empty: SDO
  const RequestsUnderWay* under_way_ = nullptr;
  Pace* pace_ = nullptr;
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
  Instant now_{};  // latest time passed by a caller
  ArbiterCounters counters_;
};

}  // namespace linegate::sdo
