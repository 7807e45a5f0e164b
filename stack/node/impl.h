// SPDX-License-Identifier: Apache-2.0
// The parts of a node and their cooperation. Private to stack/node.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "stack/emcy/consumer.h"
#include "stack/emcy/consumer_object.h"
#include "stack/emcy/error_state.h"
#include "stack/emcy/producer.h"
#include "stack/nmt/consumer_heartbeat_time.h"
#include "stack/nmt/error_behaviour.h"
#include "stack/nmt/guarding_slave.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/heartbeat_producer.h"
#include "stack/nmt/services.h"
#include "stack/nmt/slave.h"
#include "stack/node/communication_faults.h"
#include "stack/node/node.h"
#include "stack/node/sdo_clients.h"
#include "stack/node/sdo_servers.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/engine.h"
#include "stack/storage/storage.h"
#include "stack/sync/service.h"
#include "stack/time/service.h"
#include "stack/usdo/server.h"

namespace linegate::node {

// Adds the missing ones of the objects that every node of this stack has: 1000h (device type 0),
// 1001h, 1014h (80h + node-ID), 1017h (0) and 1018h (all 0). They are mandatory by CiA 301; 1014h
// and 1017h because the node serves EMCY and heartbeat. Existing objects are unchanged.
void add_mandatory_objects(od::Dictionary& dictionary, std::uint8_t node_id);

// Index bit of the error_control and emcy targets of the node's own consumers (1016h, 1028h); clear
// in those of MasterServices.
inline constexpr std::uint16_t kOwnMark = 0x100;
// Index bits of the targets for the own node-ID: guarding requests, and other devices that use this
// node-ID.
inline constexpr std::uint16_t kOwnIdMark = 0x300;

struct Node::Impl final : pdo::Listener, nmt::HeartbeatListener, nmt::LifeGuardingListener {
  Impl(od::Dictionary own_dictionary, Options own_options, EventLog& event_log,
       image::ProcessImage* image);

  // --- NMT: state.cpp ---------------------------------------------------------------------------
  void start(Instant time);
  void command(nmt::Command command, Instant time);
  void reset(bool whole_node, Instant time);
  void boot(Instant time);
  bool self_starting() const;  // by the options and 1F80h
  void be_fd();
  void configure_sdo();
  void reset_sdo();
  void state_changed(nmt::State before, Instant time);
  void keep_early_pdos();
  void suspend(Instant time);
  void resume();
  void stop_monitoring();
  void report_state(nmt::State before, Instant time);
  bool serves(can::Service service) const { return nmt::is_served(service, slave.state()); }

  // --- frames: receive.cpp ----------------------------------------------------------------------
  void receive(std::span<const can::Frame> frames);
  void receive(const can::Frame& frame);
  void receive_one(const can::Frame& frame);
  void receive_others(std::span<const can::Frame> frames);
  bool answer_sdo_request(const can::Frame& frame);
  void serve_all(const can::Target* target, const can::Frame& frame);
  void serve(can::Service service, std::uint16_t index, const can::Frame& frame);
  void remote_request(can::Target target, const can::Frame& frame);
  void receive_node_control(const can::Frame& frame);
  void receive_sync(const can::Frame& frame);
  void receive_time(const can::Frame& frame);
  void hide_monitored();
  void receive_sdo(std::uint16_t index, const can::Frame& frame);
  void receive_usdo(const can::Frame& frame);
  void receive_sdo_answer(std::uint16_t index, const can::Frame& frame);
  void receive_error_control(std::uint16_t index, const can::Frame& frame);
  void check_own_id(const can::Frame& frame);
  void receive_own_emergency(const can::Frame& frame);
  void report_duplicate(nmt::State shown, Instant time);
  void receive_emergency(std::uint16_t index, const can::Frame& frame);
  void hand_to_master_services(can::Target target, const can::Frame& frame);
  void malformed(const can::Frame& frame, std::uint8_t node);
  void unwanted(const can::Frame& frame);
  bool next_frame(can::Frame& out, Instant time, std::uint64_t number);
  void synced(std::uint8_t counter, Instant time);

  // --- time -------------------------------------------------------------------------------------
  void advance(Instant time);
  Instant next_wake() const;
  Instant next_service() const;
  void stamp(Instant time);
  // Applies written objects: timers, COB-IDs. Processes no time-out.
  void apply_writes(Instant time);

  // --- errors: errors.cpp -----------------------------------------------------------------------
  struct Lengths {  // of a PDO, in bytes
    std::uint8_t received = 0;
    std::uint8_t mapped = 0;
  };
  void begin(Fault fault, std::uint16_t number) { begin(fault, number, Lengths{}); }
  void begin(Fault fault, std::uint16_t number, Lengths lengths);
  void end(Fault fault, std::uint16_t number) {
    if (faults.end(fault, number)) [[unlikely]] {
      end_error(emergency_code(fault), number);
    }
  }
  void report_configuration_error(od::Address place, AbortCode why);
  void report_damage(storage::Damage damage);
  emcy::SendResult set_error(std::uint16_t code, std::span<const std::byte> info);
  bool reset_error(std::uint16_t code, std::span<const std::byte> info);
  emcy::SendResult report_error(std::uint16_t code, std::uint8_t bits,
                                std::span<const std::byte> info);
  void end_reported(std::uint16_t code);
  // Ends all of them. Returns the remaining error register.
  std::uint8_t end_all_reported();
  emcy::SendResult send_error_reset(std::uint8_t left, std::span<const std::byte> info);
  void end_error(std::uint16_t code, std::uint16_t number);
  // An error of that class has ended. Returns whether an error reset is to be sent, with `left` as
  // error register.
  bool wants_error_reset(std::uint16_t code, std::uint8_t& left);
  // Sends the EMCY unless the application refuses.
  void send_by_itself(std::uint16_t code, std::uint8_t error_register, emcy::ManufacturerInfo info);
  void set_error_bits(std::uint8_t temporary, std::uint8_t sticky);
  emcy::ManufacturerInfo manufacturer_bytes(std::uint16_t number, Lengths lengths) const;
  void bus_event(const can::BusEvent& event);
  void bus_state(can::BusState state);
  Indicators indicators() const;
  void obey_error_behaviour(std::uint8_t error_class);

  void heartbeat_lost(std::uint8_t node, Instant deadline) override;
  void heartbeat_recovered(std::uint8_t node, Instant time) override;
  void life_guarding_lost(Instant deadline) override;
  void life_guarding_recovered(Instant time) override;

  void rpdo_received(std::uint16_t number, Instant time) override;
  void before_tpdo(std::uint16_t number) override;
  void tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs) override;
  void rpdo_wrong_length(std::uint16_t number, unsigned mapped, unsigned received) override;
  void rpdo_deadline(std::uint16_t number) override;
  void rpdo_recovered(std::uint16_t number) override;
  void rpdo_in_order(std::uint16_t number) override;
  void mpdo_transmitted(od::Address source) override;
  void mpdo_received(std::uint16_t number, od::Address place, Instant time) override;
  void mpdo_refused(std::uint16_t number, pdo::MpdoMode mode, od::Address place,
                    AbortCode why) override;
  void mpdo_malformed(const can::Frame& frame) override;
  void pdo_unusable(od::Address place, AbortCode why) override;

  Options options;
  od::Dictionary dictionary;
  EventLog& events;
  can::Dispatch dispatch;
  can::TransmitQueue transmit;
  nmt::Slave slave;
  nmt::HeartbeatProducer heartbeat;
  nmt::GuardingSlave guarding;
  nmt::ErrorBehaviour error_behaviour;
  nmt::HeartbeatConsumer heartbeats;
  nmt::ConsumerHeartbeatTime heartbeat_times;
  sync::Service sync;
  time::Service clock;
  emcy::Producer emcy;
  emcy::Consumer emergencies;
  emcy::ConsumerObject emergency_cob_ids;
  SdoServers sdo;  // with sdo_clients: not used by a node of CANopen FD
  SdoClients sdo_clients;
  std::unique_ptr<usdo::Server> usdo;  // only of a node of CANopen FD
  pdo::Engine pdos;
  storage::Storage storage;

  MasterServices* master_services = nullptr;
  Application* application = nullptr;
  NodeCounters counters;
  Instant sync_queued{};       // time of the last SYNC of the own producer
  std::uint64_t attended = 0;  // frames processed by receive(frame)
  std::uint64_t emergency_reported =
      0;  // counters.received.frames at the last malformed EMCY reported
  CommunicationFaults faults;
  emcy::ErrorState errors;  // communication errors and the device's own
  struct Reported {
    std::uint16_t code = 0;
    std::uint8_t bits = 0;  // of the error register
  };
  std::array<Reported, Node::kMostReported> reported{};  // errors reported by the application
  std::size_t reported_count = 0;
  std::array<std::uint16_t, 256> device_errors{};  // by class: high byte of the code
  std::uint8_t sticky = 0;                         // see ErrorScheme
  std::uint8_t device_temporary = 0;               // see Node::set_error_bits()
  can::BusState bus = can::BusState::unknown;
  Instant next_overrun{};           // earliest time of the next report of lost frames
  bool duplicate_reported = false;  // reported since the last reset
  bool started = false;
  bool suspended = false;            // see Node::suspend()
  std::uint64_t applied_writes = 0;  // Dictionary::writes_reported() at the last apply_writes()
  // Of the stored parameters, reported after boot-up.
  storage::Damage damage = storage::Damage::none;
  Instant now{};  // time of the current call, for errors reported without a time
};

}  // namespace linegate::node
