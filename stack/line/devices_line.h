// SPDX-License-Identifier: Apache-2.0
// A line in the role device: virtual devices below another master. Private to stack/line.
//
// The devices are nodes on one channel, and each receives the frames that the others send. Seen
// from the gateway, inputs of the image are the values that the devices receive, outputs the values
// that they send.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stack/can/traffic.h"
#include "stack/image/process_image.h"
#include "stack/line/generic_can.h"
#include "stack/line/line.h"
#include "stack/line/outputs.h"
#include "stack/line/virtual_device.h"
#include "stack/pdo/link.h"

namespace linegate::line {

class DevicesLine final : public Line {
 public:
  // plan is device_plan() of the configuration; see Line::make().
  DevicesLine(LineConfig line_config, pdo::LinkPlan plan);

 private:
  const image::Layout& layout(image::Direction direction) const override;
  void do_start(Instant now) override;
  void do_receive(std::span<const can::Frame> frames) override;
  void do_bus_event(const can::BusEvent& event) override;
  void do_set_medium(storage::Medium* medium, ParameterSet of) override;
  void do_medium_done(bool good, ParameterSet of) override;
  bool advance(Instant now) override;
  void do_stop(Instant now) override;
  Instant next_wake() const override;
  bool do_next_frame(can::Frame& out, Instant now) override;
  bool wants_to_send(Instant now) const override;
  void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                bool merge) override;
  bool image_changed(image::Direction direction) const override;
  bool image_touched(image::Direction direction) const override;
  Input input(std::uint32_t entry, std::uint8_t part) const override;
  void set_utc(Duration offset) override;
  std::optional<Duration> network_utc(Instant now) const override;
  LineState do_state() const override;
  node::Indicators indicators() const override;
  std::optional<OwnDevice> own_device(std::uint8_t id) const override;
  std::uint64_t do_node_revision(std::uint8_t id) const override;
  NodeState do_node_state(std::uint8_t id) const override;
  // Of the device with the lowest node-ID.
  od::Dictionary& do_dictionary() override;
  const od::Dictionary& do_dictionary() const override;

  // --- devices_unsent.cpp -----------------------------------------------------------------------
  bool carries_newest(const FramesUnderWay::Awaited& awaited,
                      const can::Frame& frame) const override;
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;
  void note_acknowledged(std::uint64_t number, Instant now) override;
  void note_lost(std::uint64_t first, std::uint64_t last) override;

  // --- devices_commands.cpp ---------------------------------------------------------------------
  void do_execute(Command command, Instant now) override;
  OutputRefusal do_write_outputs(const OutputWrite& write, Instant now) override;
  bool do_feed_watchdog(const OutputWrite& write, Instant now) override;
  std::size_t output_groups() const override { return outputs.groups().size(); }
  void output_state(std::size_t position, OutputState& out) const override;
  void note_refused(const event::OutputRefused& refused, Instant now) override {
    outputs.note_refused(refused, {}, now);
  }
  void write_bound(std::span<const BoundValue> values, Instant now) override;

  struct Seat {
    std::unique_ptr<EmcyReporter> reporter;
    std::unique_ptr<VirtualDevice> device;
    std::uint64_t resets = 0;  // resets of its node that were processed
  };

  // nullptr if there is none.
  VirtualDevice* find(std::uint8_t id) const;
  // id 0 names the only device of the line; nullptr if there is no such device.
  VirtualDevice* named(std::uint8_t id) const;
  // Passes a frame to the devices. Returns true if a service of one of them uses it. except: the
  // sender, nullptr = none.
  bool hear(const can::Frame& frame, const Seat* except);
  void count_syncs();
  // The queued frames of a device that was reset are gone.
  void follow_resets(Instant now);
  Refusal reason_of(const FramesUnderWay::Sending& sending, Instant now) const;

  // --- devices_commands.cpp ---------------------------------------------------------------------
  struct Execution;  // executes the request of a command
  Error read_device(const LocalRead& request, ReplyData& data) const;
  Error write_device(const LocalWrite& request, Instant now);
  void hear_boot_up(const can::Frame& frame);
  void single_output(const Command& command, Instant now);
  void send_emcy(const Command& command, Instant now);
  Error send_nmt(const NmtRequest& request, Instant now);
  void trigger_pdo(const Command& command, Instant now);
  Error check_generic(const can::Frame& frame) const;
  void send_frame(const Command& command, Instant now);
  // Passes the written values of the image to their devices.
  void hand_out(bool always, Instant now);
  void apply_defaults(Instant now);
  void react(const Outputs::Group& group, Instant now);
  void write_bound_entry(const BoundValue& value);
  void collect(std::uint32_t entry) { written.push_back(entry); }
  void collect(const OutputBytes& run);

  image::ProcessImage image;
  std::vector<Seat> seats;  // ascending by node-ID, never empty
  Outputs outputs;
  // Of other nodes, the last event
  std::array<std::optional<Instant>, can::kMaxNodeId + 1> boot_ups;
  can::Traffic received;
  can::Traffic sent;
  Listening listening;
  std::vector<std::uint32_t> written;  // output entries, for hand_out()
  Instant advanced_to{};               // the last advance()
};

}  // namespace linegate::line
