// SPDX-License-Identifier: Apache-2.0
// A line with its own node: manager, or device with that single node (1F80h bit 0 decides, also at
// run time). Private to stack/line.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "stack/emcy/consumer.h"
#include "stack/emcy/producer.h"
#include "stack/image/process_image.h"
#include "stack/line/line.h"
#include "stack/line/own_objects.h"
#include "stack/line/services.h"
#include "stack/manager/configurator.h"
#include "stack/manager/manager.h"
#include "stack/manager/program_loader.h"
#include "stack/manager/startup_objects.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/master.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"
#include "stack/routing/forward_objects.h"
#include "stack/sdo/arbiter.h"

namespace linegate::line {

// The line connects its parts: it passes frames and time to the node, the manager and the services,
// and the results of one part to the others. Everything a line offers besides process data is a
// Service.
class NodeLine final : public Line,
                       node::MasterServices,
                       NmtHost,
                       RecordOrders,
                       SleepHost,
                       manager::Host,
                       nmt::HeartbeatListener,
                       emcy::Listener {
 public:
  // link_plan: of the configuration; see Line::make().
  NodeLine(LineConfig line_config, pdo::LinkPlan link_plan);

 private:
  // --- Line: node_line.cpp ----------------------------------------------------------------------
  const image::Layout& layout(image::Direction direction) const override;
  void do_start(Instant now) override;
  void do_stop(Instant now) override;
  void do_receive(std::span<const can::Frame> frames) override;
  bool do_next_frame(can::Frame& out, Instant now) override;
  bool wants_to_send(Instant now) const override;
  bool is_ending() const override {
    return services_.sleep.may_transmit() && services_.connections.is_ending();
  }
  void do_bus_event(const can::BusEvent& event) override;
  void do_execute(Command command, Instant now) override;
  bool do_request_pdo(std::uint16_t rpdo) override;
  bool pop_reception(pdo::Reception& out) override;
  void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                bool merge) override;
  bool image_changed(image::Direction direction) const override;
  bool image_touched(image::Direction direction) const override;
  Input input(std::uint32_t entry, std::uint8_t part) const override;
  void set_utc(Duration offset) override;
  std::optional<Duration> network_utc(Instant now) const override;
  void do_set_medium(storage::Medium* medium, ParameterSet of) override;
  void do_medium_done(bool good, ParameterSet of) override;
  void do_deliver(const routing::Message& message, Instant now) override;
  void do_set_routes(const routing::Config& wanted) override;
  void routes(std::vector<routing::Route>& out) const override;
  void set_present_gateways(std::vector<routing::GatewayLine> present) override;
  bool pop_gateway_request(routing::GatewayRequest& out) override;
  void do_answer_gateway_request(routing::GatewayAnswer answer, Instant now) override;
  od::Dictionary& do_dictionary() override { return node_.dictionary(); }
  const od::Dictionary& do_dictionary() const override { return node_.dictionary(); }
  OutputRefusal do_write_outputs(const OutputWrite& write, Instant now) override {
    return services_.outputs.write(write, now);
  }
  bool do_feed_watchdog(const OutputWrite& write, Instant now) override {
    return services_.outputs.feed_watchdog(write, now);
  }
  void set_pace(sdo::Pace& pace) override { sdo_.set_pace(pace); }
  std::size_t output_groups() const override { return services_.outputs.groups().size(); }
  void output_state(std::size_t position, OutputState& out) const override {
    services_.outputs.describe(position, out, advanced_to_);
  }
  void note_refused(const event::OutputRefused& refused, Instant now) override {
    services_.outputs.note_refused(refused, now);
  }
  [[gnu::hot]] void write_bound(std::span<const BoundValue> values, Instant now) override {
    services_.outputs.write_bound(values, now);
  }
  void note_acknowledged(std::uint64_t number, Instant now) override;
  void note_lost(std::uint64_t first, std::uint64_t last) override;
  bool carries_newest(const FramesUnderWay::Awaited& awaited,
                      const can::Frame& frame) const override;
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;
  // node_line_state.cpp
  LineState do_state() const override;
  node::Indicators indicators() const override;
  std::uint64_t do_node_revision(std::uint8_t id) const override;
  NodeState do_node_state(std::uint8_t id) const override;
  // 1F80h bit 0; at first its configured value. With a flying master: it is the active one.
  bool manages() const override { return manages_; }
  std::uint8_t active_master() const override {
    return services_.flying.is_passive() ? services_.flying.active_master() : std::uint8_t{0};
  }
  bool sleeps() const override { return services_.sleep.sleeps(); }
  bool others_sleep() const override { return services_.sleep.others_sleep(); }
  bool is_silent() const override { return !services_.sleep.may_transmit(); }

  // --- Line: node_line_advance.cpp --------------------------------------------------------------
  bool advance(Instant now) override;
  Instant next_wake() const override;
  void mark_dirty(Instant now) override;

  // --- node::MasterServices, emcy::Listener: node_line.cpp --------------------------------------
  void receive(const can::Target& target, const can::Frame& frame) override;
  void synced(Instant now) override;
  void unwanted(const can::Frame& frame) override;
  void emergency(std::uint8_t node, const emcy::Message& message, Instant now) override;
  // node_line_boot.cpp
  void before_boot(Instant now) override;
  void state_changed(nmt::State state, Instant now) override {
    services_.outputs.own().state_changed(state, now);
  }
  void tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs) override {
    services_.outputs.own().tpdo_transmitted(number, differs);
  }
  void mpdo_transmitted(od::Address source) override {
    services_.outputs.own().mpdo_transmitted(source);
  }

  // --- nmt::HeartbeatListener: node_line_monitoring.cpp -----------------------------------------
  void boot_up(std::uint8_t node, Instant now) override;
  void heartbeat(std::uint8_t node, nmt::State state, Instant now) override;
  void heartbeat_lost(std::uint8_t node, Instant deadline) override;
  void heartbeat_recovered(std::uint8_t node, Instant now) override;
  void consumer_lost(std::uint8_t node, Instant deadline) override;  // of MasterServices
  void node_data_invalid(std::uint8_t node) override;                // of manager::Host

  // --- manager::Host, NmtHost: node_line_role.cpp -----------------------------------------------
  void mandatory_nodes_booted(Instant now) override;
  void send_nmt(nmt::Command command, std::uint8_t node, Instant now) override;
  bool acknowledges_starts() const override { return under_way_.expected(); }
  void command_own(nmt::Command command, Instant now) override;
  nmt::State own_state() const override;
  void nmt_sent(nmt::Command command, std::uint8_t id, Instant now) override;
  bool has_failed() const override { return services_.diagnosis.diagnosis().fatal(); }

  // --- RecordOrders: node_line_role.cpp ---------------------------------------------------------
  void order_nmt(nmt::Command command, std::uint8_t node, Instant now,
                 std::uint32_t client) override;
  void order_trigger(std::uint8_t node, std::uint8_t rpdo, Instant now) override;
  AbortCode may_trigger(std::uint8_t node, std::uint8_t rpdo) const override;

  // --- SleepHost: node_line_role.cpp ------------------------------------------------------------
  void prepare_sleep(Instant now) override;
  void fall_silent(Instant now) override;
  void fall_asleep(Instant now) override;
  void wake_up(Instant now) override;
  void others_changed() override;
  bool is_stopped_by_error() const override {
    return has_failed() || manager_.state() == manager::ManagerState::halted;
  }

  // --- the line itself --------------------------------------------------------------------------
  // For a line whose image was made from a scan.
  void report_found_layout(Instant now);
  void receive_beside_others(std::span<const can::Frame> frames);
  void receive_asleep(std::span<const can::Frame> frames);
  void invalidate_unlike_nodes();
  void malformed(const can::Target& target, const can::Frame& frame);
  void receive_error_control(const can::Target& target, const can::Frame& frame);
  void process_completions(Instant now);
  void carry_out_orders(Instant now, std::uint32_t client);
  Input forwarded_input(std::size_t object) const;
  Counters count() const;
  // 1F80h bit 0, and bit 5 for the active master alone.
  bool wants_manager() const { return startup_.wants_manager() && !services_.flying.is_passive(); }
  Role role() const { return manages_ ? Role::manager : Role::device; }
  void interface_lost();
  // The own outputs are transmitted only while the line may use the bus.
  void follow_bus(bool asleep, Instant now);
  void hear_nmt(const can::Target& target, const can::Frame& frame);
  void write_own_values(Instant now);
  void adopt_role(Instant now);
  void change_role(Instant now);
  void stop_nodes(Instant now);
  void drop_frames_of_master();
  // A flying master hands out nothing while the bus accepts no frames: a command in the controller
  // could not be dropped any more when another node is the master.
  bool is_cut_off(Instant now) const { return services_.flying.competes() && bus_is_stuck(now); }
  // Whether only process data was received since the last next_wake(), and nothing is due: a round
  // would have nothing to do.
  bool is_idle(Instant now) const;
  void advance_all(Instant now);
  // Advances the parts that serve other nodes and the operator. Skipped while no input may concern
  // them and none of them is due.
  void advance_services(Instant now);
  Instant services_wake() const;
  bool is_dirty() const;

  // --- node and manager -------------------------------------------------------------------------
  pdo::LinkPlan plan_;
  image::ProcessImage image_;
  OwnObjects own_objects_;
  mutable routing::ForwardObjects forwarded_;  // its list is updated when it is read
  EmcyReporter emcy_reporter_{*this, 0};
  node::Node node_;
  nmt::Master nmt_;
  nmt::HeartbeatConsumer heartbeats_;
  emcy::Consumer emergencies_;
  sdo::Arbiter sdo_;
  manager::Configurator configurator_;
  manager::ProgramLoader loader_;
  // Tracks the states of the nodes in every role; acts only in the role manager.
  manager::Manager manager_;
  manager::StartupObjects startup_;
  bool manages_ = config_.role == Role::manager && !config_.flying_master;

  // --- services ---------------------------------------------------------------------------------
  Services services_{{.host = *this,
                      .nmt_host = *this,
                      .nmt = *this,
                      .orders = *this,
                      .sleep_host = *this,
                      .config = config_,
                      .node = node_,
                      .image = image_,
                      .own_objects = own_objects_,
                      .forwarded = forwarded_,
                      .plan = plan_,
                      .master = nmt_,
                      .heartbeats = heartbeats_,
                      .sdo = sdo_,
                      .configurator = configurator_,
                      .loader = loader_,
                      .manager = manager_,
                      .events = events_,
                      .load = load_,
                      .messages = messages_,
                      .routed = routed_}};
  std::array<Service*, kRequestKinds.size()> service_of_{};  // by Request::index()

  // --- time -------------------------------------------------------------------------------------
  std::uint64_t resets_ = 0;  // resets of the own node that were processed
  Instant advanced_to_{};
  Instant woke_at_{};  // from the last sleep
  // The last result of next_wake() without PDOs and outputs, which may have become due since.
  mutable Instant rest_until_{};
  mutable std::uint64_t rest_served_ = 0;  // Node::served() at that time

  bool dirty_ = true;  // see mark_dirty() and is_dirty()
  // When the services must be advanced next, as of their last round.
  Instant services_due_{};
  std::uint64_t events_seen_ = 0;
  std::uint64_t writes_seen_ = 0;
};

}  // namespace linegate::line
