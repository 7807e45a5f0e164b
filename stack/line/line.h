// SPDX-License-Identifier: Apache-2.0
// A line: one CAN network attached to this process, as an object without I/O, thread or clock.
//
// Frames and time go in; frames, events, replies and snapshots come out. All calls come from one
// thread at a time. `now` never goes back between calls.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/event.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/can/frame.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/config.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/node/indicators.h"
#include "stack/routing/message.h"

namespace linegate::od {
class Dictionary;
}
namespace linegate::pdo {
struct Reception;
}
namespace linegate::storage {
class Medium;
}

namespace linegate::line {

class Line {
 public:
  // Builds dictionary, image and copy plans. Everything that can go wrong goes wrong here, with
  // diagnostics (file = the device file or the line's name).
  static Loaded<std::unique_ptr<Line>> make(LineConfig config);
  ~Line();
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  const LineConfig& config() const;
  const image::Layout& layout(image::Direction direction) const;
  // Grows when a layout becomes another one, which only that of an observer does: with what it
  // learns of PDO mappings. The old one is gone then.
  std::uint64_t layout_revision() const;

  // Where the own node stores its parameters (1010h), before start(); must outlive the line. What
  // is stored takes the place of what the configuration says. device: node-ID of the one of
  // LineConfig::devices that it is for; 0 = the own node. With kLssMedium: for its node-ID, which
  // LSS stores.
  static constexpr std::uint8_t kLssMedium = 0x80;
  void set_medium(storage::Medium* medium, std::uint8_t device = 0);

  // --- input ----------------------------------------------------------------------------------

  // UTC (since 1970-01-01) is protocol time + offset: for the TIME producer. Whenever it is known
  // better.
  void set_utc(Duration offset);

  // Begins to run: own boot-up, then the work of the role.
  void start(Instant now);
  // Frames in the order of reception, each processed at its own frame.time (<= now). No time-out
  // runs in here. Never allocates for PDO, SYNC, heartbeat.
  void receive(std::span<const can::Frame> frames, Instant now);
  // The bit rates at which the bus runs, in bit/s, for its load: where the configuration gives
  // none, and for the data phase of FD frames (0 = not known).
  void set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate);
  void bus_event(const can::BusEvent& event);
  // Before start(): the owner reports what becomes of the frames that next_frame() gives. Otherwise
  // each counts as acknowledged on the bus when it is given.
  void expect_acknowledgements();
  // The bus acknowledged the frames up to that number, except those that are lost. Outputs become
  // valid and commands are answered by it. Never allocates while no command waits.
  void acknowledged(std::uint64_t number, Instant now);
  // The frames first..last never get onto the bus (bus-off, a failed interface), or it is not known
  // whether they did.
  void lost(std::uint64_t first, std::uint64_t last);
  // Something the owner of the line noticed about it (queue_full, clock_step, ...): it gets its
  // number here, in the one sequence of the line. event.number is ignored.
  void report(const Event& event);
  // A slow medium ended what it was given: call advance() soon.
  void medium_done(bool good, std::uint8_t device = 0);
  // Runs what is due. Call it after the socket has been drained, so that a late thread reports no
  // loss that did not happen.
  void advance(Instant now);
  // Queues the command; its reply comes out of take_reply().
  void execute(Command command, Instant now);
  // Applies it, or reports OutputRefusal as an event and returns it.
  OutputRefusal write_outputs(const OutputWrite& write, Instant now);
  // All of them, before any PDO is sent. Without a watchdog. An observer ignores it.
  void write_bound(std::span<const BoundValue> values, Instant now);
  // Asks a device with a remote frame for the PDO that is this RPDO of the line (a local number, as
  // in image::Entry::local_pdo). False if it cannot be: see pdo::Engine::request_rpdo().
  bool request_pdo(std::uint16_t rpdo);
  // What another line of this process has for this one. message.to is this line's interface; one
  // that takes no part in routing refuses as whom it was addressed.
  void deliver(const routing::Message& message, Instant now);
  // Other lines of this process came or went, or the routes are others: takes interfaces, routes
  // and emcy_networks of `wanted` into the configuration and 1F2Ch, 1F2Fh, 5F20h. Connections go
  // on. No effect on a line that takes no part in routing.
  void set_routes(const routing::Config& wanted, Instant now);
  // Stops in good order: commands under way are answered, nodes are sent to Pre-operational if so
  // configured, the own node leaves Operational. Frames and events remain to be taken.
  void stop(Instant now);

  // --- output ---------------------------------------------------------------------------------

  // When advance() is wanted next at the latest; kNever if never.
  Instant next_wake() const;
  // The most urgent frame to send, in bus order; false if there is none. A frame given counts as
  // handed to the bus at `now`; the frames are numbered from 1 in this order.
  bool next_frame(can::Frame& out, Instant now);
  // Whether next_frame() would give one.
  bool wants_to_send(Instant now) const;
  // take_events() or take_reply() would give something.
  bool has_news() const;
  // Oldest events first; gives how many.
  std::size_t take_events(std::span<Event> out);
  bool take_reply(Reply& out);

  // The oldest message for another line of this process (message.to is its interface); false if
  // there is none. Look after each receive(), deliver(), execute() and advance(). What cannot be
  // handed on: see routing::undeliverable().
  bool take_message(routing::Message& out);

  // The oldest reception of those TPDOs that have a queue (NodeConfig::tpdo_queue); false if there
  // is none. Every frame that an RPDO of the line takes is one, in the order of reception; when a
  // queue is full its oldest is dropped and counted.
  bool take_reception(pdo::Reception& out);

  // Copies what is stale in `into` (a snapshot of this line and direction, or an empty one) and
  // clears the marks. With merge, the marks already in `into`, which nobody has read, are kept too.
  void snapshot(image::Direction direction, image::Snapshot& into, Instant now, bool merge);
  // Something changed / was received since the last snapshot of that direction.
  bool image_changed(image::Direction direction) const;
  bool image_touched(image::Direction direction) const;
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
  Input input(std::uint32_t entry) const;
  // UTC (since 1970-01-01) as the last TIME message of another device tells it; nothing if none
  // came.
  std::optional<Duration> network_utc(Instant now) const;
  // SYNCs seen so far: for publication on SYNC.
  std::uint32_t sync_count() const;

  LineState state() const;
  // The routes that 1F2Ch has now, whoever wrote them; none if the line does not route. What was in
  // `out` is gone.
  void routes(std::vector<routing::Route>& out) const;
  // RUN and ERROR of the own node (CiA 303-3).
  node::Indicators indicators() const;
  // Another one with every change that NodeState shows; for cheap polling.
  std::uint64_t node_revision(std::uint8_t node) const;
  NodeState node_state(std::uint8_t node) const;  // 1..127
  // Nothing if the line has no such device of its own. A change counts in node_revision().
  std::optional<OwnDevice> own_device(std::uint8_t node) const;

  // The own dictionary, for tests and local commands. Without const the caller may write: the next
  // advance() looks at every service of the line then.
  od::Dictionary& dictionary();
  const od::Dictionary& dictionary() const;
  // Groups of outputs, 0 of an observer; the state of one of them, position < output_groups().
  std::size_t output_groups() const;
  void output_state(std::size_t position, OutputState& out) const;

 private:
  struct Base;
  struct Impl;      // manager, and device with the one own node
  struct Observer;  // has nothing to transmit with
  struct Devices;   // device with nodes of its own, see LineConfig::devices
  explicit Line(std::unique_ptr<Base> impl);
  std::unique_ptr<Base> impl_;
};

}  // namespace linegate::line
