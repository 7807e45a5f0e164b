// SPDX-License-Identifier: Apache-2.0
// Runs one line on its channel and hands over its results.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runtime/binder.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/frame_pump.h"
#include "gateway/runtime/line_port.h"
#include "gateway/runtime/route_links.h"
#include "gateway/runtime/runner.h"
#include "gateway/runtime/storage_thread.h"
#include "stack/line/line.h"
#include "stack/line/request_budget.h"

namespace linegate::gateway {

// Decides when a snapshot of one direction is due.
class Publication {
 public:
  Publication(config::Publish rule, Duration touched_period)
      : rule_(rule), touched_period_(touched_period) {}

  // touched_period: time after which a reception without a change causes a snapshot (on_change); a
  // year: never.
  bool due(const line::Line& line, image::Direction direction, Instant now);
  // When the next snapshot is due if nothing else happens; kNever if something must happen first.
  Instant next(const line::Line& line, image::Direction direction);
  void taken(const line::Line& line, Instant now);
  // When the next snapshot is due if values change as often as they did; kNever if that is unknown,
  // or was before now.
  Instant expected(Instant now) const {
    return in_series_ && last_ + rule_.time > now ? last_ + rule_.time : kNever;
  }
  // The line has another image, because its layout changed.
  void image_replaced() { changed_ = false; }

 private:
  config::Publish rule_;
  Duration touched_period_;
  bool first_ = true;
  bool changed_ = false;    // the image is known to have changed since the last snapshot
  bool in_series_ = false;  // the last two snapshots were as close as the rule permits (on_change)
  Instant last_{};
  std::uint32_t last_sync_ = 0;
};

class LineRunner final : public Runner {
 public:
  // consumer: wakes the consumer of the port. It, the port, and the files with the stored
  // parameters of the line's nodes must outlive the runner.
  LineRunner(std::unique_ptr<line::Line> line, std::unique_ptr<can_bridge::Channel> channel,
             const config::LinePlan& plan, LinePort& port, exchange::Wakeup& consumer,
             std::vector<NodeStorage> storage = {});

  // Before it runs: the line's inputs that other lines follow, and its outputs that follow inputs.
  void bind(std::vector<BoundSource> sources, std::vector<BoundTarget> targets);
  // On its thread: adds a binding with a line that was made anew.
  void bind(const BoundSource& source) {
    bound_sources_.push_back(source);
    inputs_changed_ = true;
  }
  void bind(const BoundTarget& target) { bound_targets_.push_back(target); }
  // On its thread: the other line of that link was removed; its last values are taken first.
  void unbind(const BoundLink& link, Instant now);
  // Writes values of another line of the same executor, and sends the resulting frames. Returns
  // false, without effect, while the line is not running: a line that starts reads the values of
  // the link.
  bool receive_bound(const BoundLink& link, std::span<const line::Line::Input> values, Instant now);

  // Before it runs, if the line routes: its links to other lines.
  void route(std::unique_ptr<RouteEnd> routes) { routes_ = std::move(routes); }
  RouteEnd* routes() { return routes_.get(); }
  // On its thread: the line with that interface was removed; its last messages are taken first.
  void leave(std::uint8_t interface, Instant now);

  // On its thread, see line::Line::set_routes().
  void set_routes(const routing::Config& wanted, Instant now);

  // On its thread: a scan that was to be applied was not, see ScanApplier::kept().
  void scan_kept() { scans_.kept(); }

  int descriptor() const override { return pump_.channel().descriptor(); }
  bool wants_writable() const override { return pump_.channel().wants_writable(); }
  void service(Instant now) override;
  void nothing_to_read() override { nothing_to_read_ = true; }
  bool has_values() const override;
  void called() override { called_ = true; }
  exchange::Wakeup* announce() override;
  Instant next_wake() const override {
    return routes_ != nullptr && routes_->arrived() ? Instant{} : next_wake_;
  }
  void stop(Instant now) override;
  bool stopped(Instant now) const override;

  const line::Line& line() const { return *line_; }

 private:
  bool needs_reading(Instant now);
  bool is_only_for_images(Instant now) const;
  Instant receive(Instant now);
  void wake_at(Instant now) { next_wake_ = work_due_ = now; }
  std::optional<can::BusEvent> as_usable(can::BusEvent event);
  void bus_event(const can::BusEvent& reported, Instant now);
  void poll_storage_results();
  void poll_calls(Instant now);
  void start_scan(Instant now);
  void poll_requests(Instant now);
  void queue_command(Instant now);
  void execute_admitted_commands(Instant now);
  void execute_command(Instant now);
  void poll_outputs(Instant now);
  void write_held_outputs(Instant now);
  void answered(std::uint64_t tag);
  void fill_budget(Instant now);
  void note_next_due();
  void report_accepted(const request::GatewayCommand& command, Instant now);
  void poll_interface_commands(Instant now);
  void poll_messages(Instant now);
  void look_at_sources(Instant now);
  void give_messages(Instant now);
  void poll_gateways(Instant now);
  void give_gateway_requests();
  void restart_bus(const request::GatewayCommand& command, Instant now);
  void change_faults(const request::GatewayCommand& command, std::string_view change, Instant now);
  bool is_snapshot_due(Instant now);
  void hold_snapshot(Instant now);
  void hand_over(Instant now);
  void hand_over_events();
  void hand_over_replies();
  void hand_over_receptions();
  void hand_over_outputs(Instant now);
  void hand_over_layouts();
  void hand_over_routes();
  void hand_over_images(Instant now);
  void hand_over_image(image::Direction direction, Instant now);
  void hand_over_status(Instant now);
  void look_at_clock();
  void look_at_losses();
  void transmit(Instant now);
  void report_ended(Instant now);
  void reply(std::uint64_t tag, Error error, std::string_view text = {});
  Instant compute_next_wake();
  Instant next_image();
  Instant expected_image(Instant now) const {
    return earlier(publications_[0].expected(now), publications_[1].expected(now));
  }

  // The members that each round uses are adjacent, to occupy few cache lines: other programs on the
  // processor evict them meanwhile.
  std::unique_ptr<line::RequestBudget> budget_;  // outlives the line, which uses it as its pace
  std::unique_ptr<line::Line> line_;
  std::unique_ptr<RouteEnd> routes_;  // nullptr if the line does not route
  DirectImages* const direct_;        // port_.direct
  bool started_ = false;
  bool stopping_ = false;
  bool lacks_fd_ = false;  // the interface is there, but carries no CAN FD, which the line needs
  bool commands_first_ = true;
  bool status_wanted_ = true;
  bool forwarded_ = false;      // values went to or came from another line in this round
  bool inputs_changed_ = true;  // maybe, other than by the frames received in this round
  bool handed_over_ = false;
  bool nothing_to_read_ = false;
  bool called_ = true;  // other threads may have put something into a ring
  bool reply_held_ = false;
  bool receptions_wait_ = false;  // in the line, because their ring is full
  const bool has_queues_;         // a TPDO has a queue
  Instant next_wake_{};
  Instant work_due_{};  // next_wake_ without images, status and full rings
  Instant known_{};     // latest time that was passed to the line
  Instant status_due_{};
  Instant image_due_{};          // the last result of next_image()
  Instant budget_due_ = kNever;  // when a waiting request may be carried out
  // The timer is set to it at once, instead of again when the next frame has come.
  Instant image_expected_ = kNever;
  Instant held_until_{};  // delay of images and status that are due
  std::vector<BoundSource> bound_sources_;
  std::vector<BoundTarget> bound_targets_;
  std::array<Publication, 2> publications_;  // by image::Direction
  std::uint32_t receive_peak_ = 0;
  ScanApplier scans_;
  FramePump pump_;

  LinePort& port_;
  exchange::Wakeup& consumer_;
  const std::vector<NodeStorage> storage_;
  WallClock clock_;
  std::vector<routing::Route> routes_shown_;
  std::vector<routing::Route> routes_now_;
  Instant stop_deadline_ = kNever;
  std::uint64_t layout_revision_ = 0;
  std::array<std::uint64_t, 128> revisions_{};
  std::array<Event, FramePump::kBatch> events_{};
  line::RequestBudget::Admitted admitted_;
  line::Command command_;
  line::OutputWrite write_;
  line::Reply reply_;
  routing::GatewayRequest gateway_request_;
  routing::GatewayAnswer gateway_answer_;
  pdo::Reception reception_;
  std::uint64_t losses_reported_ = 0;
};

}  // namespace linegate::gateway
