// SPDX-License-Identifier: Apache-2.0
// What a line is in every role, and what each role has to say. Private to stack/line.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/emcy/producer.h"
#include "stack/line/bus_load.h"
#include "stack/line/frames_under_way.h"
#include "stack/line/generic_can.h"
#include "stack/line/line.h"
#include "stack/line/service.h"
#include "stack/pdo/reception.h"

namespace linegate::line {

// Functions without a comment are those of Line with the same name.
struct Line::Base : ServiceHost {
  explicit Base(LineConfig line_config);

  virtual const image::Layout& layout(image::Direction direction) const = 0;
  virtual void start(Instant now) = 0;
  virtual void receive(std::span<const can::Frame> frames) = 0;
  virtual void bus_event(const can::BusEvent& event) = 0;
  virtual void advance(Instant now) = 0;
  virtual void execute(Command command, Instant now) = 0;
  virtual OutputRefusal write_outputs(const OutputWrite& write, Instant now) = 0;
  virtual void stop(Instant now) = 0;
  virtual Instant next_wake() const = 0;
  virtual void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                        bool merge) = 0;
  virtual bool image_changed(image::Direction direction) const = 0;
  virtual bool image_touched(image::Direction direction) const = 0;
  virtual Input input(std::uint32_t entry) const = 0;
  virtual std::optional<Duration> network_utc(Instant now) const = 0;
  virtual LineState state() const = 0;
  virtual std::uint64_t node_revision(std::uint8_t id) const = 0;
  virtual NodeState node_state(std::uint8_t id) const = 0;
  virtual od::Dictionary& dictionary() = 0;

  // Of a role with outputs.
  virtual std::size_t output_groups() const { return 0; }
  virtual void output_state(std::size_t /*position*/, OutputState& /*out*/) const {}
  virtual void note_refused(std::uint16_t /*group*/, OutputRefusal /*refusal*/, Instant /*now*/) {}

  // A role that has a node of its own, and transmits.
  virtual bool next_frame(can::Frame& out, Instant now);
  virtual bool wants_to_send(Instant now) const;
  virtual void write_bound(std::span<const BoundValue> values, Instant now);
  virtual bool request_pdo(std::uint16_t rpdo);
  virtual bool take_reception(pdo::Reception& out);
  virtual std::uint64_t layout_revision() const;  // fixed but for an observer
  virtual void set_utc(Duration offset);
  virtual void set_medium(storage::Medium* medium, std::uint8_t device);
  virtual void medium_done(bool good, std::uint8_t device);
  virtual node::Indicators indicators() const;
  virtual std::optional<OwnDevice> own_device(std::uint8_t id) const;
  virtual void deliver(const routing::Message& message, Instant now);
  virtual void set_routes(const routing::Config& wanted);
  virtual void routes(std::vector<routing::Route>& out) const;
  // What became of frames, for the services of the role.
  virtual void note_acknowledged(std::uint64_t /*number*/, Instant /*now*/) {}
  virtual void note_lost(std::uint64_t /*first*/, std::uint64_t /*last*/) {}
  // The frame carries what the command waits for of a TPDO, see FramesUnderWay::Awaited. from: of
  // which device, in the role device.
  virtual bool carries_newest(const FramesUnderWay::Awaited& awaited,
                              const can::Frame& frame) const;
  // The answer to a command whose time is over.
  virtual void answer_unsent(FramesUnderWay::Sending& sending, Instant now);
  // Something other than process data and time comes; now: where it is known.
  virtual void stir(Instant now = {});

  // receive() and next_frame() where load wants to see the frames.
  void receive_counted(std::span<const can::Frame> frames);
  bool next_counted(can::Frame& out, Instant now);
  void emit(EventKind kind, Instant time, std::uint32_t code = 0, std::uint32_t value = 0);
  // Takes up and tells what a bridge noticed; false if it is nothing new.
  bool note(const can::BusEvent& event);
  bool is_running() const override { return running; }
  bool usable() const override;
  bool manages() const override { return false; }
  void reply(std::uint64_t tag, Error error, std::vector<std::byte> data = {}) override;
  void refuse(const Command& command, Refusal refusal, Instant now) override;
  // The reply that the command ends with; a Refusal is an event, too.
  void answer(const Command& command, Error error, std::vector<std::byte> data, Instant now);
  OutputRefusal refuse(const OutputWrite& write, OutputRefusal refusal, Instant now);

  // --- line_under_way.cpp --------------------------------------------------------------------
  void acknowledged(std::uint64_t number, Instant now);
  void lost(std::uint64_t first, std::uint64_t last);
  // The frame that is handed out; from: see carries_newest().
  void note_handed_out(const can::Frame& frame, Instant now, std::uint8_t from = 0);
  void find_sendings(const can::Frame& frame, std::uint8_t from);
  bool is_awaited(const FramesUnderWay::Awaited& awaited, const can::Frame& frame,
                  std::uint8_t from) const;
  void answer_when_sent(FramesUnderWay::Sending sending, Instant now) override;
  void expire_sendings(Instant now);
  // As emcy::SentReporter. device: see FramesUnderWay::Awaited.
  void report_when_sent(std::uint8_t device, const can::Frame& frame, const Event& event,
                        EventLog& log);
  // Commands of that kind whose frames are gone before they were handed out. device: see
  // FramesUnderWay::Awaited.
  void refuse_sendings(CommandKind kind, Refusal why, Instant now, std::uint8_t device = 0);
  void cancel_sendings();
  bool bus_is_stuck(Instant now) const;

  // Of an own node.
  struct EmcyReporter final : emcy::SentReporter {
    EmcyReporter(Base& of_line, std::uint8_t of_device) : line(of_line), device(of_device) {}
    void emcy_queued(const can::Frame& frame, const Event& event, EventLog& log) override {
      line.report_when_sent(device, frame, event, log);
    }
    Base& line;
    std::uint8_t device;
  };

  FramesUnderWay under_way;
  LineConfig config;
  EventLog events;
  BusLoad load;
  Listening listening;
  can::BusState bus = can::BusState::unknown;
  std::optional<can::BusState> failed_from;  // state before the interface failed
  std::uint8_t transmit_errors = 0;
  std::uint8_t receive_errors = 0;
  bool running = false;
  Counters counters;
  std::uint32_t syncs = 0;
  std::deque<Reply> replies;
  routing::MessageQueue messages;  // for other lines
  routing::Counters routed;
};

}  // namespace linegate::line
