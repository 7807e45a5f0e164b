// SPDX-License-Identifier: Apache-2.0
// The parts of a line that has a node of its own (manager, device) and how they are joined. Private
// to stack/line.
#pragma once

#include <array>
#include <bitset>
#include <memory>
#include <optional>
#include <vector>

#include "stack/emcy/consumer.h"
#include "stack/emcy/producer.h"
#include "stack/image/process_image.h"
#include "stack/line/boot_service.h"
#include "stack/line/configure_service.h"
#include "stack/line/diagnosis_service.h"
#include "stack/line/ends_under_way.h"
#include "stack/line/frames_under_way.h"
#include "stack/line/line_base.h"
#include "stack/line/lss_service.h"
#include "stack/line/outputs.h"
#include "stack/line/own_objects.h"
#include "stack/line/pdo_request_service.h"
#include "stack/line/pdo_updates.h"
#include "stack/line/program_service.h"
#include "stack/line/record_service.h"
#include "stack/line/routing_service.h"
#include "stack/line/scan_service.h"
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

struct Line::Impl final : Line::Base,
                          node::Companion,
                          manager::Host,
                          nmt::HeartbeatListener,
                          emcy::Listener,
                          RecordOrders {
  // plan is that of the configuration; see Line::make().
  Impl(LineConfig line_config, pdo::LinkPlan link_plan);

  // --- line.cpp -------------------------------------------------------------------------------
  const image::Layout& layout(image::Direction direction) const override;
  void start(Instant now) override;
  // Of a line whose image is made of what a scan found.
  void report_found_layout(Instant now);
  void receive(std::span<const can::Frame> frames) override;
  void receive_and_route(std::span<const can::Frame> frames);
  void stop(Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  bool next_frame(can::Frame& out, Instant now) override;
  bool wants_to_send(Instant now) const override;
  bool request_pdo(std::uint16_t rpdo) override;
  // line_pdo.cpp
  void write_by_mpdo(const Command& command, Instant now);
  std::uint16_t named_mpdo(const Command& command) const;
  AbortCode queue_mpdo(const Command& command, std::uint16_t number);
  // Of that TPDO of the own node.
  can::Frame mpdo_frame(std::uint16_t number, const pdo::MpdoData& data) const;
  bool take_reception(pdo::Reception& out) override;
  void bus_event(const can::BusEvent& event) override;
  void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                bool merge) override;
  bool image_changed(image::Direction direction) const override;
  bool image_touched(image::Direction direction) const override;
  Input input(std::uint32_t entry) const override;
  void set_utc(Duration offset) override;
  std::optional<Duration> network_utc(Instant now) const override;
  void set_medium(storage::Medium* medium, std::uint8_t device) override;
  void medium_done(bool good, std::uint8_t device) override;
  LineState state() const override;
  node::Indicators indicators() const override;
  std::uint64_t node_revision(std::uint8_t id) const override;
  NodeState node_state(std::uint8_t id) const override;
  void deliver(const routing::Message& message, Instant now) override;
  void set_routes(const routing::Config& wanted) override;
  void routes(std::vector<routing::Route>& out) const override;
  od::Dictionary& dictionary() override;
  Counters count() const;
  // As 1F80h bit 0 says; that of the configuration at first.
  bool manages() const override { return manages_; }
  Role role() const { return manages_ ? Role::manager : Role::device; }
  void interface_lost();
  void hear_nmt(std::uint16_t index, const can::Frame& frame);
  // --- line_advance.cpp -------------------------------------------------------------------------
  void stir(Instant now) override;
  // Nothing came but process data since next_wake() was asked, and nothing is due: a round has
  // nothing to do.
  bool rests(Instant now) const;
  void advance_all(Instant now);
  // The services that serve other nodes and the operator. Not looked at while nothing came that may
  // concern them and none of them is due.
  void advance_services(Instant now);
  Instant services_wake() const;
  bool is_stirred() const;
  void malformed(const can::Target& target, const can::Frame& frame);
  void take_completions(Instant now);

  // node::Companion
  void receive(const can::Target& target, const can::Frame& frame) override;
  void synced(Instant now) override;
  void unwanted(const can::Frame& frame) override;
  void before_boot(Instant now) override;
  void consumer_lost(std::uint8_t node, Instant deadline) override;
  // manager::Host
  void node_data_invalid(std::uint8_t node) override;
  void may_operate(Instant now) override;
  void send_nmt(nmt::Command command, std::uint8_t node, Instant now) override;
  bool acknowledges_starts() const override { return under_way.expected(); }
  void command_own(nmt::Command command, Instant now) override;
  nmt::State own_state() const override;
  // nmt::HeartbeatListener
  void boot_up(std::uint8_t node, Instant now) override;
  void heartbeat(std::uint8_t node, nmt::State state, Instant now) override;
  void heartbeat_lost(std::uint8_t node, Instant deadline) override;
  void heartbeat_recovered(std::uint8_t node, Instant now) override;
  void begin_anew(nmt::Command command, Instant now);
  // --- line_records.cpp: RecordOrders -----------------------------------------------------------
  void order_nmt(nmt::Command command, std::uint8_t node, Instant now) override;
  void order_trigger(std::uint8_t node, std::uint8_t rpdo, Instant now) override;
  AbortCode may_trigger(std::uint8_t node, std::uint8_t rpdo) const override;
  void write_own_values(Instant now);
  // emcy::Listener
  void emergency(std::uint8_t node, const emcy::Message& message, Instant now) override;

  // --- line_commands.cpp ------------------------------------------------------------------------
  struct Pending {
    std::uint64_t number = 0;  // of the SDO transfer
    std::uint8_t node = 0;     // of it, on this line
    std::uint64_t tag = 0;     // of the command
    Instant deadline = kNever;
    bool tells_way = false;  // of an object_write
  };
  void execute(Command command, Instant now) override;
  void start_sdo(Command command, bool write, Instant now);
  void start_in_network(Command command, Instant now);
  // An access to the own dictionary that waits for its answer.
  struct LocalWrite {
    od::Ticket ticket = 0;
    std::uint64_t tag = 0;  // of the command
    std::vector<std::byte> data;
  };
  // CommandKind::local_read of the device file of a node.
  Error list_device_file(const Command& command, std::vector<std::byte>& data) const;
  void access_own(const Command& command);
  void finish_local_writes();
  void single_output(Command command, Instant now);
  void answer_write(Command command, std::uint16_t tpdo, PdoWait wait, Instant now);
  void send_emcy(const Command& command, Instant now);
  void command_nmt(const Command& command, Instant now);
  Error send_nmt(const Command& command, Instant now);
  void send_frame(const Command& command, Instant now);
  void command_completed(sdo::Completion& completion);
  void expire_commands(Instant now);
  Instant next_command_deadline() const;

  // --- line_unsent.cpp ------------------------------------------------------------------------
  void note_acknowledged(std::uint64_t number, Instant now) override;
  void note_lost(std::uint64_t first, std::uint64_t last) override;
  bool carries_newest(const FramesUnderWay::Awaited& awaited,
                      const can::Frame& frame) const override;
  void answer_unsent(FramesUnderWay::Sending& sending, Instant now) override;
  void answer_unsent_value(FramesUnderWay::Sending& sending, Instant now);
  Refusal reason_of(const FramesUnderWay::Sending& sending, Instant now) const;

  // --- line_role.cpp ----------------------------------------------------------------------------
  void take_role(Instant now);
  void change_role(Instant now);

  // --- line_objects.cpp -------------------------------------------------------------------------
  void write_object(Command command, Instant now);
  void write_by_pdo(Command command, std::span<const std::uint32_t> entries, Instant now);
  Refusal check_write_by_pdo(const Command& command, std::span<const std::uint32_t> entries) const;
  bool asks_at_once(std::uint16_t tpdo);
  PdoWait wait_of(std::uint16_t tpdo) const;
  // What an object_write or output_write answers.
  std::vector<std::byte> way_of(std::uint16_t tpdo, PdoWait wait) const;
  void ask_for_updated(Instant now);
  Error create_object(const Command& command);
  bool answer_from_image(const Command& command);
  std::vector<std::uint16_t> named_tpdos(const Command& command) const;
  Error trigger_pdos(const Command& command, std::vector<std::uint16_t>& triggered, Instant now);
  void answer_trigger(const Command& command, Instant now);

  // --- line_outputs.cpp -------------------------------------------------------------------------
  OutputRefusal write_outputs(const OutputWrite& write, Instant now) override;
  std::size_t output_groups() const override { return outputs.groups().size(); }
  void output_state(std::size_t position, OutputState& out) const override;
  void note_refused(std::uint16_t group, OutputRefusal refusal, Instant now) override {
    outputs.note_refused(group, refusal, {}, now);
  }
  void write_bound(std::span<const BoundValue> values, Instant now) override;
  Input forwarded_input(std::size_t object) const;
  void request_forwarded(std::span<const BoundValue> values, Instant now);
  void apply(const OutputWrite& write, bool always, Instant now);
  void apply_defaults(Instant now);
  OutputWait reason_of(std::uint32_t entry) const;
  void react(const Outputs::Group& group, Instant now);
  void zero(const Outputs::Group& group, Instant now);
  pdo::Engine::Receiver receiver(std::uint8_t id) const;
  // A single value may be written: its receiver is known to be Operational, or nothing is known of
  // it.
  bool takes_single_writes(std::uint8_t id) const {
    return id == config.node_id || receiver(id) != pdo::Engine::Receiver::waiting;
  }
  // An NMT command was sent, or heard of another master; id 0 = to all: a node that
  // leaves Operational by it counts as Operational only when its state was heard since then.
  void note_command(nmt::Command command, std::uint8_t id);
  // The line itself sent it: the state that each node is expected to take follows it.
  void note_sent(nmt::Command command, std::uint8_t id, Instant now);
  // The node was commanded to leave Operational.
  void expect_state(std::uint8_t id);
  void confirm(std::uint8_t id, nmt::State state, Instant now);
  Duration heartbeat_time(std::uint8_t id) const;
  void outputs_invalid(std::uint8_t id);
  // An NMT command was handed out as the frame of that number.
  void note_nmt(const can::Frame& frame, std::uint64_t number);
  // Frames up to that number were acknowledged: what was heard of a node before a command other
  // than start to it was on the bus does not show that it is Operational after the command.
  void note_acknowledged_ends(std::uint64_t number);
  void note_end(const nmt::NodeControl& control);
  void note_lost_ends(std::uint64_t first, std::uint64_t last);
  // Of nodes without error control, which are started when the bus acknowledged the command: if it
  // lost it, it is sent again.
  void forget_starts(std::uint8_t id);  // 0: of all
  void note_acknowledged_starts(std::uint64_t number);
  void note_lost_starts(std::uint64_t first, std::uint64_t last);
  void repeat_lost_starts(Instant now);
  // Values by MPDO are refused that wait when the own node leaves Operational.
  void follow_own_state(Instant now);
  // Outputs have new values there: requests their PDOs, and sends own objects of the MPDO scanner
  // list in source address mode. always: unchanged ones, too.
  void outputs_written(std::uint32_t bit_offset, std::uint32_t bits, bool always, Instant now);
  // Hands the states of the nodes to the PDO engine, which sends the outputs of those that were
  // started.
  void follow_receivers();

  // --- line_scanned.cpp -------------------------------------------------------------------------
  // An own object of the outputs which no PDO carries; there is none without a scanner list.
  struct ScannedOutput {
    std::uint32_t entry = 0;
    std::optional<std::uint64_t> sent{};  // the value that the PDO engine took
    std::uint64_t number = 0;             // of its frame, while it is under way to the bus
    bool due = false;                     // the newest value has to be sent
    bool confirmed = false;               // it was acknowledged
    bool written = false;                 // scratch
  };
  void find_scanned_outputs();
  void scanned_written(std::uint32_t bit_offset, std::uint32_t bits, bool always);
  void send_scanned();
  void confirm_scanned(ScannedOutput& scanned);
  void follow_scanned();
  std::uint16_t scanner_tpdo() const;
  can::Frame scanned_frame(const ScannedOutput& scanned) const;
  void scanned_handed_out(const can::Frame& frame, std::uint64_t number);
  void scanned_acknowledged(std::uint64_t number);
  void scanned_lost(std::uint64_t first, std::uint64_t last);
  void answer_scanned(Command command, Instant now);

  pdo::LinkPlan plan;
  image::ProcessImage image;
  OwnObjects own_objects;
  mutable routing::ForwardObjects forwarded;  // its list is brought up to date by who asks
  EmcyReporter emcy_reporter{*this, 0};
  node::Node node;
  nmt::Master nmt;
  nmt::HeartbeatConsumer heartbeats;
  emcy::Consumer emergencies;
  sdo::Arbiter sdo;
  manager::Configurator configurator;
  manager::ProgramLoader loader;
  manager::Manager manager;  // keeps the states of the nodes in every role, acts in that of manager
  manager::StartupObjects startup;

  bool manages_ = config.role == Role::manager;

  LssService lss;
  ScanService scanning;
  RoutingService routing;
  PdoRequestService pdo_requests;
  BootService booting;
  ConfigureService configuring;
  ProgramService programming;
  DiagnosisService diagnosing;  // behind whatever it asks for the state of the network
  RecordService records;
  // In the order in which they are advanced.
  const std::array<Service*, 9> services{&lss,          &scanning, &routing,
                                         &pdo_requests, &booting,  &configuring,
                                         &programming,  &records,  &diagnosing};
  std::array<Service*, kCommandKinds> service_of{};  // by CommandKind; nullptr: of the line itself

  Outputs outputs;
  std::vector<ScannedOutput> scanned_outputs;
  bool scanned_due = false;          // some of them are
  std::uint64_t scanned_starts = 0;  // of the own node, as follow_scanned() saw them
  PdoUpdates updates;
  std::uint64_t resets = 0;  // of the own node that were followed

  // Of the SDO transfers of commands.
  struct CommandTransfers final : sdo::TransferOwner {
    explicit CommandTransfers(Impl& of) : line(of) {}
    ~CommandTransfers() override { line.sdo.disown(*this); }
    void completed(sdo::Completion& completion, Instant /*now*/) override {
      line.command_completed(completion);
    }
    Impl& line;
  };
  CommandTransfers command_transfers{*this};
  std::vector<Pending> pending;
  std::vector<LocalWrite> local_writes;
  std::uint64_t transfers = 0;  // numbers given so far

  // By node: how many heartbeats have to report Operational, see note_command(), and when the last
  // one of them did.
  struct Unconfirmed {
    std::uint8_t heartbeats = 0;
    Instant heard{};
  };
  std::array<Unconfirmed, can::kMaxNodeId + 1> unconfirmed{};
  // By node: the frame of the last NMT command start to it, and whether the bus lost that.
  std::array<std::uint64_t, can::kMaxNodeId + 1> start_frames{};
  std::bitset<can::kMaxNodeId + 1> lost_starts;
  EndsUnderWay ends;
  // By node: the newest own NMT command to it that was handed out, unless that is a start or was
  // acknowledged or lost: the number of its frame.
  std::array<std::uint64_t, can::kMaxNodeId + 1> newest_ends{};
  std::bitset<can::kMaxNodeId + 1> has_end;
  std::uint64_t own_starts = 0;      // of the own node, in follow_own_state()
  bool receivers_changed = true;     // what follow_receivers() goes by, besides:
  std::uint64_t receivers_seen = 0;  // Manager::changes() then

  Instant advanced_to{};
  // What next_wake() found last, without PDOs and outputs, which may have become due since.
  mutable Instant rest_until{};
  mutable std::uint64_t rest_served = 0;  // Node::served() then

  bool stirred = true;  // something other than process data and time came, see is_stirred()
  // When the services were advanced last.
  Instant services_due{};
  std::uint64_t events_seen = 0;
  std::uint64_t writes_seen = 0;
};

}  // namespace linegate::line
