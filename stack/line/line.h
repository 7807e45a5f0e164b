// SPDX-License-Identifier: Apache-2.0
// A line: one CAN network attached to this process, as an object without I/O, thread or clock.
//
// Frames and time go in; frames, events, replies and snapshots come out. All calls come from one
// thread at a time. `now` never goes back between calls.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/event.h"
#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/can/frame.h"
#include "stack/emcy/producer.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/bus_load.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/line/frames_under_way.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/service.h"
#include "stack/line/state.h"
#include "stack/node/indicators.h"
#include "stack/pdo/reception.h"
#include "stack/routing/message.h"

namespace linegate::od {
class Dictionary;
}
namespace linegate::storage {
class Medium;
}

namespace linegate::line {

// What a medium stores for a line.
struct ParameterSet {
  enum class Kind : std::uint8_t {
    objects,  // parameters of the object dictionary (1010h)
    lss,      // node-ID and bit rate that LSS stores (CiA 305)
  };
  std::uint8_t device = 0;  // node-ID of the one of LineConfig::devices; 0 = the own node
  Kind kind = Kind::objects;
};

// What every role has in common. A role is a subclass: NodeLine (manager, and device with one own
// node), DevicesLine (device with LineConfig::devices), ObserverLine. Functions of a role that are
// called do_...() are the role's part of the public function with that name.
class Line : protected ServiceHost {
 public:
  // Makes the line of the role, builds dictionary, image and copy plans. Everything that can go
  // wrong goes wrong here, with diagnostics (file = the device file or the line's name).
  static Loaded<std::unique_ptr<Line>> make(LineConfig config);

  const LineConfig& config() const { return config_; }
  virtual const image::Layout& layout(image::Direction direction) const = 0;
  // Grows when a layout becomes another one, which only that of an observer does: with what it
  // learns of PDO mappings. The old one is gone then.
  virtual std::uint64_t layout_revision() const { return 0; }

  // Where those parameters are stored, before start(); must outlive the line. Stored values replace
  // those of the configuration. No effect on a role that does not have them.
  void set_medium(storage::Medium* medium, ParameterSet of = {});

  // --- input ----------------------------------------------------------------------------------

  // UTC (since 1970-01-01) is protocol time + offset: for the TIME producer. Whenever it is known
  // better.
  virtual void set_utc(Duration /*offset*/) {}

  // Begins to run: own boot-up, then the work of the role.
  void start(Instant now);
  // Frames in the order of reception, each processed at its own frame.time (<= now). No time-out
  // runs in here. Never allocates for PDO, SYNC, heartbeat.
  void receive(std::span<const can::Frame> frames, Instant /*now*/) {
    if (load_.wants_fast()) [[unlikely]] {
      load_.count_fast(frames);
    }
    do_receive(frames);
  }
  // The bit rates at which the bus runs, in bit/s, for its load: where the configuration gives
  // none, and for the data phase of FD frames (0 = not known).
  void set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate);
  void bus_event(const can::BusEvent& event);
  // Before start(): the owner reports what becomes of the frames that next_frame() gives. Otherwise
  // each counts as acknowledged on the bus when it is given.
  void expect_acknowledgements() { under_way_.expect(); }
  // The bus acknowledged the frames up to that number, except those that are lost. Outputs become
  // valid and commands are answered by it. Never allocates while no command waits.
  void acknowledged(std::uint64_t number, Instant now);
  // The frames first..last never get onto the bus (bus-off, a failed interface), or it is not known
  // whether they did.
  void lost(std::uint64_t first, std::uint64_t last);
  // An event that the owner of the line reports about it (queue_full, clock_step, ...): it gets its
  // number here, in the one sequence of the line. event.number is ignored.
  void report(const Event& event);
  // A slow medium ended what it was given: call advance() soon.
  void medium_done(bool good, ParameterSet of = {});
  // Runs what is due. Call it after the socket has been drained, so that a late thread reports no
  // loss that did not happen.
  virtual void advance(Instant now) = 0;
  // Queues the command; its reply comes out of take_reply().
  void execute(Command command, Instant now);
  // Applies it, or reports OutputRefusal as an event and returns it.
  OutputRefusal write_outputs(const OutputWrite& write, Instant now);
  // All of them, before any PDO is sent. Without a watchdog. An observer ignores it.
  virtual void write_bound(std::span<const BoundValue> /*values*/, Instant /*now*/) {}
  // Requests a PDO from a device with a remote frame: that RPDO of the line (a local number, as in
  // image::Entry::local_pdo). False if it cannot be requested: see pdo::Engine::request_rpdo().
  bool request_pdo(std::uint16_t rpdo);
  // A message of another line of this process. message.to is this line's interface; one that takes
  // no part in routing rejects on behalf of the addressee.
  void deliver(const routing::Message& message, Instant now);
  // Other lines of this process came or went, or the routes are others: takes interfaces, routes
  // and emcy_networks of `wanted` into the configuration and 1F2Ch, 1F2Fh, 5F20h. Connections go
  // on. No effect on a line that takes no part in routing.
  void set_routes(const routing::Config& wanted, Instant now);
  // Stops in good order: commands under way are answered, nodes are sent to Pre-operational if so
  // configured, the own node leaves Operational. Frames and events remain to be taken. No effect on
  // a line that does not run.
  void stop(Instant now);

  // --- output ---------------------------------------------------------------------------------

  // When advance() is wanted next at the latest; kNever if never.
  virtual Instant next_wake() const = 0;
  // The most urgent frame to send, in bus order; false if there is none. A frame given counts as
  // handed to the bus at `now`; the frames are numbered from 1 in this order.
  bool next_frame(can::Frame& out, Instant now) {
    const bool given = do_next_frame(out, now);
    if (given && load_.wants_fast()) [[unlikely]] {
      load_.count_fast(std::span(&out, 1));
    }
    return given;
  }
  // Whether next_frame() would give one.
  virtual bool wants_to_send(Instant /*now*/) const { return false; }
  // take_events() or take_reply() would give something.
  bool has_news() const { return !events_.empty() || !replies_.empty(); }
  // Oldest events first; gives how many.
  std::size_t take_events(std::span<Event> out) { return events_.take(out); }
  // Up to out.size() of its newest events, taken or not, oldest first; returns how many. For the
  // report of a violated assertion.
  std::size_t newest_events(std::span<Event> out) const { return events_.newest(out); }
  bool take_reply(Reply& out);

  // The oldest message for another line of this process (message.to is its interface); false if
  // there is none. Look after each receive(), deliver(), execute() and advance(). What cannot be
  // handed on: see routing::undeliverable().
  bool take_message(routing::Message& out) { return messages_.pop(out); }

  // The oldest reception of those TPDOs that have a queue (NodeConfig::tpdo_queue); false if there
  // is none. Every frame that an RPDO of the line takes is one, in the order of reception; when a
  // queue is full its oldest is dropped and counted.
  virtual bool take_reception(pdo::Reception& /*out*/) { return false; }

  // Copies what is stale in `into` (a snapshot of this line and direction, or an empty one) and
  // clears the marks. With merge, the marks already in `into`, which nobody has read, are kept too.
  virtual void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                        bool merge) = 0;
  // Something changed / was received since the last snapshot of that direction.
  virtual bool image_changed(image::Direction direction) const = 0;
  virtual bool image_touched(image::Direction direction) const = 0;
  // One entry of the inputs, as it is now, or kForwarded | place in LineConfig::forwarding: what
  // RPDOs that map the object brought. Precondition: it exists.
  static constexpr std::uint32_t kForwarded = 0x8000'0000;
  struct Input {
    std::uint64_t value = 0;
    bool valid = false;
    bool late = false;      // its PDO has not come within its deadline
    Instant received{};     // of the PDO it came with; role device: always 0
    std::uint16_t pdo = 0;  // number of that PDO
  };
  virtual Input input(std::uint32_t entry) const = 0;
  // UTC (since 1970-01-01) by the last TIME message of another device; nothing if none came.
  virtual std::optional<Duration> network_utc(Instant now) const = 0;
  // SYNCs seen so far: for publication on SYNC.
  std::uint32_t sync_count() const { return syncs_; }

  LineState state() const;
  // The routes that 1F2Ch has now, by whomever it was written; none if the line does not route.
  // Replaces the contents of `out`.
  virtual void routes(std::vector<routing::Route>& out) const { out.clear(); }
  // RUN and ERROR of the own node (CiA 303-3).
  virtual node::Indicators indicators() const { return {}; }
  // Another one with every change that NodeState shows; for cheap polling.
  std::uint64_t node_revision(std::uint8_t node) const;
  NodeState node_state(std::uint8_t node) const;  // 1..127
  // Nothing if the line has no such device of its own. A change counts in node_revision().
  virtual std::optional<OwnDevice> own_device(std::uint8_t /*node*/) const { return std::nullopt; }

  // The own dictionary, for tests and local commands. Without const the caller may write: the next
  // advance() looks at every service of the line then.
  od::Dictionary& dictionary();
  const od::Dictionary& dictionary() const { return do_dictionary(); }
  // Groups of outputs, 0 of an observer; the state of one of them, position < output_groups().
  virtual std::size_t output_groups() const { return 0; }
  virtual void output_state(std::size_t /*position*/, OutputState& /*out*/) const {}

 protected:
  explicit Line(LineConfig config);

  // Events of an own node that are emitted when the bus acknowledged their EMCY.
  class EmcyReporter final : public emcy::SentReporter {
   public:
    // device: see FramesUnderWay::Awaited.
    EmcyReporter(Line& line, std::uint8_t device) : line_(line), device_(device) {}
    void emcy_queued(const can::Frame& frame, const Event& event, EventLog& log) override {
      line_.report_when_sent(device_, frame, event, log);
    }

   private:
    Line& line_;
    std::uint8_t device_;
  };

  // Something other than process data and time comes in: the next advance() must do a whole round.
  // now: where it is known.
  virtual void mark_dirty(Instant /*now*/ = {}) {}

  void emit(EventKind kind, Instant time, std::uint32_t code = 0, std::uint32_t value = 0);
  // ServiceHost
  bool is_running() const override { return running_; }
  bool usable() const override;
  bool manages() const override { return false; }
  void reply(std::uint64_t tag, Error error, std::vector<std::byte> data = {}) override;
  void refuse(const Command& command, Refusal refusal, Instant now) override;
  // A message to a line that takes no part in routing: its sender is not left waiting.
  void reject(const routing::Message& message);

  // --- line_under_way.cpp --------------------------------------------------------------------
  // The frame that is handed out; from: see carries_newest().
  void note_handed_out(const can::Frame& frame, Instant now, std::uint8_t from = 0);
  void answer_when_sent(FramesUnderWay::Sending sending, Instant now) override;
  void expire_sendings(Instant now);
  void refuse_unsent(CommandKind kind, Refusal why, Instant now) override {
    refuse_unsent(kind, why, now, 0);
  }
  // device: see FramesUnderWay::Awaited.
  void refuse_unsent(CommandKind kind, Refusal why, Instant now, std::uint8_t device);
  void cancel_sendings();
  bool bus_is_stuck(Instant now) const override;

  LineConfig config_;
  EventLog events_;
  BusLoad load_;
  can::BusState bus_ = can::BusState::unknown;
  std::uint8_t transmit_errors_ = 0;
  std::uint8_t receive_errors_ = 0;
  bool running_ = false;
  Counters counters_;
  std::uint32_t syncs_ = 0;
  FramesUnderWay under_way_;
  routing::MessageQueue messages_;  // for other lines
  routing::Counters routed_;

 private:
  // The role's part of the public functions.
  virtual void do_start(Instant now) = 0;
  virtual void do_receive(std::span<const can::Frame> frames) = 0;
  virtual void do_bus_event(const can::BusEvent& event) = 0;  // a new one
  virtual void do_execute(Command command, Instant now) = 0;
  virtual OutputRefusal do_write_outputs(const OutputWrite& write, Instant now) = 0;
  virtual void do_stop(Instant now) = 0;  // of a line that ran
  virtual bool do_next_frame(can::Frame& /*out*/, Instant /*now*/) { return false; }
  virtual bool do_request_pdo(std::uint16_t /*rpdo*/) { return false; }
  virtual void do_set_medium(storage::Medium* /*medium*/, ParameterSet /*of*/) {}
  virtual void do_medium_done(bool /*good*/, ParameterSet /*of*/) {}
  virtual void do_deliver(const routing::Message& message, Instant /*now*/) { reject(message); }
  virtual void do_set_routes(const routing::Config& /*wanted*/) {}
  virtual LineState do_state() const = 0;
  virtual std::uint64_t do_node_revision(std::uint8_t node) const = 0;
  virtual NodeState do_node_state(std::uint8_t node) const = 0;
  virtual od::Dictionary& do_dictionary() = 0;
  virtual const od::Dictionary& do_dictionary() const = 0;

  // A write to a group of outputs was refused before it came here.
  virtual void note_refused(std::uint16_t /*group*/, OutputRefusal /*refusal*/, Instant /*now*/) {}
  // What became of frames, for the services of the role.
  virtual void note_acknowledged(std::uint64_t /*number*/, Instant /*now*/) {}
  virtual void note_lost(std::uint64_t /*first*/, std::uint64_t /*last*/) {}
  // The frame carries what the command waits for of a TPDO, see FramesUnderWay::Awaited. from: of
  // which device, in the role device.
  virtual bool carries_newest(const FramesUnderWay::Awaited& awaited,
                              const can::Frame& frame) const;
  // The answer to a command whose time is over.
  virtual void answer_unsent(FramesUnderWay::Sending& sending, Instant now);

  // Takes up and reports what a bridge noticed; false if it is nothing new.
  bool note(const can::BusEvent& event);
  void find_sendings(const can::Frame& frame, std::uint8_t from);
  bool is_awaited(const FramesUnderWay::Awaited& awaited, const can::Frame& frame,
                  std::uint8_t from) const;
  void report_when_sent(std::uint8_t device, const can::Frame& frame, const Event& event,
                        EventLog& log);

  std::optional<can::BusState> failed_from_;  // state before the interface failed
  std::deque<Reply> replies_;
};

}  // namespace linegate::line
