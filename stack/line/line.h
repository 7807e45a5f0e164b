// SPDX-License-Identifier: Apache-2.0
// A line: one CAN network attached to this process, as an object without I/O, thread or clock.
//
// Its inputs are frames and time; its outputs are frames, events, replies and snapshots. At any
// time only one thread may call it. `now` never decreases from call to call.
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
#include "stack/routing/gateway_request.h"
#include "stack/routing/message.h"

namespace linegate::od {
class Dictionary;
}
namespace linegate::sdo {
class Pace;
}
namespace linegate::storage {
class Medium;
}

namespace linegate::line {

// A set of parameters that a medium stores for a line.
struct ParameterSet {
  enum class Kind : std::uint8_t {
    objects,  // parameters of the object dictionary (1010h)
    lss,      // node-ID and bit rate that LSS stores (CiA 305)
  };
  std::uint8_t device = 0;  // node-ID of one of LineConfig::devices; 0 = the own node
  Kind kind = Kind::objects;
};

// The common part of all roles. Each role is a subclass: NodeLine (manager, and device with one own
// node), DevicesLine (device with LineConfig::devices), ObserverLine. A function do_...() is the
// role's part of the public function with that name.
class Line : protected ServiceHost {
 public:
  // Creates the line of the configured role with its dictionary, image and copy plans. All checks
  // happen here; errors are returned as diagnostics (file = the device file or the line's name).
  static Loaded<std::unique_ptr<Line>> make(LineConfig config);

  const LineConfig& config() const { return config_; }
  virtual const image::Layout& layout(image::Direction direction) const = 0;
  // Increases when a layout changes, which happens only in an observer, when it learns PDO
  // mappings. The old layout is destroyed.
  virtual std::uint64_t layout_revision() const { return 0; }

  // Sets where these parameters are stored, before start(); the medium must outlive the line.
  // Stored values replace those of the configuration. No effect if the role does not have them.
  void set_medium(storage::Medium* medium, ParameterSet of = {});

  // --- input ----------------------------------------------------------------------------------

  // UTC (since 1970-01-01) is protocol time + offset: for the TIME producer. Call it whenever the
  // offset is known better.
  virtual void set_utc(Duration /*offset*/) {}

  // Starts the line: own boot-up, then the work of the role.
  void start(Instant now);
  // Frames in the order of reception, each processed at its own frame.time (<= now). No time-out
  // expires in this call. Never allocates for PDO, SYNC, heartbeat.
  void receive(std::span<const can::Frame> frames, Instant /*now*/) {
    if (load_.wants_fast()) [[unlikely]] {
      counters_.fd_frames_received += load_.count_fast(frames);
    }
    do_receive(frames);
  }
  // The bit rates of the bus in bit/s, for its load: used where the configuration has none, and for
  // the data phase of FD frames (0 = unknown).
  void set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate);
  void bus_event(const can::BusEvent& event);
  // Before start(): the owner will report the outcome of the frames that next_frame() returns.
  // Otherwise each counts as acknowledged on the bus when it is returned.
  void expect_acknowledgements() { under_way_.expect(); }
  // The bus acknowledged the frames up to that number, except those that were lost. This makes
  // outputs valid and answers commands. Never allocates while no command waits.
  void acknowledged(std::uint64_t number, Instant now);
  // The frames first..last will never be sent (bus-off, a failed interface), or it is unknown
  // whether they were.
  void lost(std::uint64_t first, std::uint64_t last);
  // Reports an event of the line's owner (queue_full, clock_step, ...): it gets the next event
  // number of the line. event.number is ignored.
  void report(const Event& event);
  // A slow medium has finished a write: call advance() soon.
  void medium_done(bool good, ParameterSet of = {});
  // Executes everything that is due. Call it after the socket has been drained, so that a late
  // thread does not report a loss that did not happen. Returns false if nothing was due and nothing
  // but process data was received: then the call changed no input().
  virtual bool advance(Instant now) = 0;
  // Queues the command; pop_reply() returns its reply. An audited command that is not refused at
  // once is an event.
  void execute(Command command, Instant now);
  // Applies the write, or reports an OutputRefusal as an event and returns it.
  OutputRefusal write_outputs(const OutputWrite& write, Instant now);
  // For a write that the owner applies later, see RequestBudget: if its group is in use, its
  // watchdog starts again. Returns false, without effect, if the write would be refused.
  bool feed_watchdog(const OutputWrite& write, Instant now) { return do_feed_watchdog(write, now); }
  // Limits the frames of SDO commands from now on; pace must outlive the line. No effect if the
  // role has no SDO client.
  virtual void set_pace(sdo::Pace& /*pace*/) {}
  // Writes all values before any PDO is sent. Without a watchdog. An observer ignores it.
  virtual void write_bound(std::span<const BoundValue> /*values*/, Instant /*now*/) {}
  // Requests a PDO from a device with a remote frame: that RPDO of the line (a local number, as in
  // image::Entry::local_pdo). Returns false if it cannot be requested: see
  // pdo::Engine::request_rpdo().
  bool request_pdo(std::uint16_t rpdo);
  // Delivers a message of another line of this process. message.to is this line's interface; a line
  // that does not take part in routing rejects on behalf of the addressee.
  void deliver(const routing::Message& message, Instant now);
  // Lines of this process were added or removed, or the routes changed: takes interfaces, routes
  // and emcy_networks of `wanted` into the configuration and 1F2Ch, 1F2Fh, 5F20h. Open connections
  // continue. No effect on a line that does not take part in routing.
  void set_routes(const routing::Config& wanted, Instant now);
  // The lines of other gateways that can be reached (routing::Interface::way); none at first.
  virtual void set_present_gateways(std::vector<routing::GatewayLine> /*present*/) {}
  // The answer to a request of pop_gateway_request(). One that nothing waits for is discarded.
  void answer_gateway_request(routing::GatewayAnswer answer, Instant now);
  // Stops in an orderly way: commands under way are answered, nodes are sent to Pre-operational if
  // so configured, the own node leaves Operational. Frames and events can still be taken
  // afterwards. No effect on a line that is not running.
  void stop(Instant now);

  // --- output ---------------------------------------------------------------------------------

  // The latest time of the next advance(); kNever if none is needed.
  virtual Instant next_wake() const = 0;
  // Returns the most urgent frame to send, in bus order; false if there is none. A returned frame
  // counts as handed to the bus at `now`; frames are numbered from 1 in this order.
  bool next_frame(can::Frame& out, Instant now) {
    const bool given = do_next_frame(out, now);
    if (given && load_.wants_fast()) [[unlikely]] {
      counters_.fd_frames_sent += load_.count_fast(std::span(&out, 1));
    }
    return given;
  }
  // Whether next_frame() would return one.
  virtual bool wants_to_send(Instant /*now*/) const { return false; }
  // Whether pop_events() or pop_reply() would return something.
  bool has_news() const { return !events_.empty() || !replies_.empty(); }
  // Oldest events first; returns their number.
  std::size_t pop_events(std::span<Event> out) { return events_.take(out); }
  // Up to out.size() of its newest events, taken or not, oldest first; returns their number. For
  // the report of a violated assertion.
  std::size_t newest_events(std::span<Event> out) const { return events_.newest(out); }
  bool pop_reply(Reply& out);

  // The oldest message for another line of this process (message.to is its interface); false if
  // there is none. Call it after each receive(), deliver(), execute() and advance(). For a message
  // that cannot be delivered see routing::undeliverable().
  bool pop_message(routing::Message& out) { return messages_.pop(out); }

  // The oldest request to another gateway, or the end of one; false if there is none. Call it as
  // pop_message(). Exactly one answer is expected, at any time: at its deadline the line gives up.
  virtual bool pop_gateway_request(routing::GatewayRequest& /*out*/) { return false; }

  // The oldest reception of the TPDOs that have a queue (NodeConfig::tpdo_queue); false if there is
  // none. Every frame that an RPDO of the line accepts is one reception, in the order of reception;
  // when a queue is full, its oldest is dropped and counted.
  virtual bool pop_reception(pdo::Reception& /*out*/) { return false; }

  // Copies the parts of `into` that are out of date (a snapshot of this line and direction, or an
  // empty one) and clears the marks. With merge, the marks already in `into`, which were not read
  // yet, are kept as well.
  virtual void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                        bool merge) = 0;
  // Whether anything changed or was received since the last snapshot of that direction.
  virtual bool image_changed(image::Direction direction) const = 0;
  virtual bool image_touched(image::Direction direction) const = 0;
  // The present value of an entry of the inputs, or of kForwarded | place in
  // LineConfig::forwarding: as received in the RPDOs that map the object. Precondition: it exists.
  static constexpr std::uint32_t kForwarded = 0x8000'0000;
  struct Input {
    std::uint64_t value = 0;
    bool valid = false;
    bool late = false;      // its PDO was not received within its deadline
    Instant received{};     // time of its last PDO; role device: always 0
    std::uint16_t pdo = 0;  // number of that PDO
  };
  Input input(std::uint32_t entry) const { return input(entry, 0); }
  // The same for 8 bytes of an entry of more than 64 bits, those from byte 8 * part on.
  // Precondition: part < image::value_parts(entry).
  virtual Input input(std::uint32_t entry, std::uint8_t part) const = 0;
  // UTC (since 1970-01-01) by the last TIME message of another device; nothing if none was
  // received.
  virtual std::optional<Duration> network_utc(Instant now) const = 0;
  // Number of SYNCs so far: for publication on SYNC.
  std::uint32_t sync_count() const { return syncs_; }

  LineState state() const;
  // The present routes of 1F2Ch, whether configured or written by SDO; none if the line does not
  // route. Replaces the contents of `out`.
  virtual void routes(std::vector<routing::Route>& out) const { out.clear(); }
  // The line was stopped, and still exchanges frames with nodes: it releases the SDO connections
  // that it assigned. Continue to call receive(), advance() and next_frame() for a short time.
  virtual bool is_ending() const { return false; }
  // RUN and ERROR of the own node (CiA 303-3).
  virtual node::Indicators indicators() const { return {}; }
  // A number that differs after every change of NodeState; for cheap polling.
  std::uint64_t node_revision(std::uint8_t node) const;
  NodeState node_state(std::uint8_t node) const;  // 1..127
  // Nothing if the line has no such own device. A change is included in node_revision().
  virtual std::optional<OwnDevice> own_device(std::uint8_t /*node*/) const { return std::nullopt; }

  // The own dictionary, for tests and local commands. The non-const version may be used to write,
  // so the next advance() checks every service of the line.
  od::Dictionary& dictionary();
  const od::Dictionary& dictionary() const { return do_dictionary(); }
  // Number of output groups, 0 for an observer; the state of one of them, position <
  // output_groups().
  virtual std::size_t output_groups() const { return 0; }
  virtual void output_state(std::size_t /*position*/, OutputState& /*out*/) const {}

 protected:
  explicit Line(LineConfig config);

  // Emits events of an own node when the bus acknowledged their EMCY.
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

  // Something other than process data and time was received: the next advance() must do a complete
  // round. now: where it is known.
  virtual void mark_dirty(Instant /*now*/ = {}) {}

  void emit(Instant time, const EventData& data) { events_.emit({.time = time, .data = data}); }
  // ServiceHost
  bool is_running() const override { return running_; }
  bool usable() const override;
  bool manages() const override { return false; }
  // Of flying masters: the node-ID of the active one; 0 = not known, the own node, or the line is
  // none.
  virtual std::uint8_t active_master() const { return 0; }
  void reply(std::uint64_t tag, Error error, ReplyData data = {}) override;
  void refuse(const Command& command, Refusal refusal, Instant now, std::uint8_t node = 0,
              ReplyData data = {}) override;
  // Rejects a message to a line that does not take part in routing, so that its sender does not
  // wait.
  void reject(const routing::Message& message);

  // --- line_under_way.cpp --------------------------------------------------------------------
  // Call it with each frame that is handed to the bus; from: see carries_newest().
  void note_handed_out(const can::Frame& frame, Instant now, std::uint8_t from = 0);
  void answer_when_sent(FramesUnderWay::Sending sending, Instant now) override;
  void expire_sendings(Instant now);
  void refuse_unsent(CommandKind kind, Refusal why, Instant now) override {
    refuse_unsent(kind, why, now, 0);
  }
  // device: see FramesUnderWay::Awaited.
  void refuse_unsent(CommandKind kind, Refusal why, Instant now, std::uint8_t device);
  void refuse_gone(const std::function<bool(const Command&)>& is_gone, Refusal why,
                   Instant now) override;
  void cancel_sendings();
  // No frame is sent any more: gives each waiting command the reply of answer_unsent().
  void end_sendings(Instant now);
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
  virtual void do_bus_event(const can::BusEvent& event) = 0;  // called for a change only
  virtual void do_execute(Command command, Instant now) = 0;
  virtual OutputRefusal do_write_outputs(const OutputWrite& write, Instant now) = 0;
  virtual bool do_feed_watchdog(const OutputWrite& /*write*/, Instant /*now*/) { return false; }
  virtual void do_stop(Instant now) = 0;  // called if the line was running
  virtual bool do_next_frame(can::Frame& /*out*/, Instant /*now*/) { return false; }
  virtual bool do_request_pdo(std::uint16_t /*rpdo*/) { return false; }
  virtual void do_set_medium(storage::Medium* /*medium*/, ParameterSet /*of*/) {}
  virtual void do_medium_done(bool /*good*/, ParameterSet /*of*/) {}
  virtual void do_deliver(const routing::Message& message, Instant /*now*/) { reject(message); }
  virtual void do_set_routes(const routing::Config& /*wanted*/) {}
  virtual void do_answer_gateway_request(routing::GatewayAnswer /*answer*/, Instant /*now*/) {}
  virtual LineState do_state() const = 0;
  virtual std::uint64_t do_node_revision(std::uint8_t node) const = 0;
  virtual NodeState do_node_state(std::uint8_t node) const = 0;
  virtual od::Dictionary& do_dictionary() = 0;
  virtual const od::Dictionary& do_dictionary() const = 0;

  // The owner refused a write to a group of outputs before it reached the line.
  virtual void note_refused(const event::OutputRefused& /*refused*/, Instant /*now*/) {}
  // The outcome of frames, for the services of the role.
  virtual void note_acknowledged(std::uint64_t /*number*/, Instant /*now*/) {}
  virtual void note_lost(std::uint64_t /*first*/, std::uint64_t /*last*/) {}
  // Whether the frame carries the TPDO values that the command waits for, see
  // FramesUnderWay::Awaited. from: node-ID of the sending device, in the role device.
  virtual bool carries_newest(const FramesUnderWay::Awaited& awaited,
                              const can::Frame& frame) const;
  // The reply to a command whose time has passed.
  virtual void answer_unsent(FramesUnderWay::Sending& sending, Instant now);

  // Processes and reports a bus event; returns false if it is nothing new.
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
