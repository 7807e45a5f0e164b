// SPDX-License-Identifier: Apache-2.0
// Construction of a node, its NMT states, and the services that each state permits.
#include <utility>

#include "stack/node/impl.h"
#include "stack/od/objects.h"

namespace linegate::node {
namespace {

constexpr od::Address kHighResolutionStamp{od::objects::kHighResolutionTime, 0};
constexpr od::Address kNmtStartup{od::objects::kNmtStartup, 0};
constexpr std::uint64_t kNmtMaster = 0x01;
constexpr std::uint64_t kNotSelfStarting = 0x04;
constexpr std::uint64_t kFlyingMaster = 0x20;

// CANopen FD has no node guarding and no SDO.
void remove_classical_objects(od::Dictionary& dictionary) {
  (void)dictionary.remove(od::objects::kGuardTime);
  (void)dictionary.remove(od::objects::kLifeTimeFactor);
  for (std::uint16_t index = od::objects::kSdoServer; index <= od::objects::kLastSdoClient;
       ++index) {
    (void)dictionary.remove(index);
  }
}

od::Dictionary completed(od::Dictionary dictionary, const Options& options) {
  add_mandatory_objects(dictionary, options.node_id);
  if (options.fd) {
    remove_classical_objects(dictionary);
  }
  return dictionary;
}

}  // namespace

Node::Impl::Impl(od::Dictionary own_dictionary, Options own_options, EventLog& event_log,
                 image::ProcessImage* image)
    : options(own_options),
      dictionary(completed(std::move(own_dictionary), own_options)),
      events(event_log),
      heartbeat(dictionary, transmit, own_options.node_id),
      guarding(dictionary, transmit, events, *this, own_options.node_id),
      error_behaviour(dictionary),
      heartbeats(dispatch, events, kOwnMark),
      heartbeat_times(dictionary, heartbeats),
      sync(dictionary, dispatch, transmit, events),
      clock(dictionary, dispatch, transmit),
      emcy(dictionary, transmit, events, own_options.node_id),
      emergencies(dispatch, events, kOwnMark),
      emergency_cob_ids(dictionary, emergencies),
      sdo(dictionary, dispatch, events, own_options.node_id),
      sdo_clients(dictionary, dispatch, events, own_options.clients_of_default_servers),
      pdos(dictionary, dispatch, events, image),
      storage(dictionary, own_options.node_id) {
  const std::pair<std::uint16_t, od::Hook*> hooks[] = {
      {od::objects::kErrorHistory, &emcy.history()},
      {od::objects::kSyncCobId, &sync},
      {od::objects::kSyncPeriod, &sync},
      {od::objects::kSyncWindow, &sync},
      {od::objects::kSyncCounterOverflow, &sync},
      {od::objects::kTimeCobId, &clock},
      {od::objects::kEmcyCobId, &emcy},
      {od::objects::kEmcyInhibitTime, &emcy},
      {od::objects::kConsumerHeartbeatTime, &heartbeat_times},
      {od::objects::kProducerHeartbeatTime, &heartbeat},
      {od::objects::kStoreParameters, &storage},
      {od::objects::kRestoreDefaults, &storage},
      {od::objects::kVerifyConfiguration, &storage.configuration()},
      {od::objects::kGuardTime, &guarding},
      {od::objects::kLifeTimeFactor, &guarding},
      {od::objects::kErrorBehaviour, &error_behaviour},
      {od::objects::kEmcyConsumer, &emergency_cob_ids},
  };
  for (const auto& [index, hook] : hooks) {
    (void)dictionary.set_hook(index, hook).ok();  // the object may be optional and missing
  }
  heartbeats.set_listener(this);
  pdos.set_node_id(own_options.node_id);
  sync.set_node_id(own_options.node_id);
  pdos.set_listener(this, false);
  pdos.set_auto_notify(options.auto_notify);
  dispatch.add(can::kErrorControlBase + options.node_id, false, can::Service::error_control,
               static_cast<std::uint16_t>(kOwnIdMark | options.node_id));
  emcy.listen_for_others(dispatch, static_cast<std::uint16_t>(kOwnIdMark | options.node_id));
  dispatch.add(can::kNmtId, false, can::Service::nmt, 0);
  if (options.fd) {
    be_fd();
  }
}

// The identifier of a USDO request has the node-ID of its client.
void Node::Impl::be_fd() {
  pdos.set_max_length(can::kMaxFdData);
  usdo = std::make_unique<usdo::Server>(dictionary, options.node_id, events,
                                        usdo::ServerOptions{.abort_form = options.usdo_abort});
  if (options.emcy_fd) {
    emergencies.accept_fd();
    emcy.be_fd([this](Instant when) {
      const std::optional<Duration> utc = clock.network_utc(when);
      const auto time = utc ? time::to_time_of_day(*utc) : std::nullopt;
      std::array<std::byte, 6> out{};
      if (time) {
        std::ranges::copy_n(time::encode(*time, {}).data.begin(), out.size(), out.begin());
      }
      return out;
    });
  }
  for (std::uint8_t client = can::kMinNodeId; client <= can::kMaxNodeId; ++client) {
    if (client != options.node_id) {
      dispatch.add(can::kSdoRequestBase + client, false, can::Service::usdo, client);
    }
  }
}

void Node::Impl::configure_sdo() {
  if (usdo != nullptr) {
    usdo->reset();
    return;
  }
  sdo.configure();
  sdo_clients.configure();
}

void Node::Impl::reset_sdo() {
  if (usdo != nullptr) {
    usdo->reset();
    return;
  }
  sdo.reset();
  sdo_clients.reset();
}

void Node::Impl::start(Instant time) {
  damage = storage.load();
  if (std::exchange(started, true)) {
    transmit.clear();
    slave.initialise();
    reset(true, time);
    return;
  }
  if (storage.apply(true) && application != nullptr) {
    application->reset(true, time);
  }
  boot(time);
}

void Node::Impl::command(nmt::Command command, Instant time) {
  now = time;
  const nmt::State before = slave.state();
  if (command == nmt::Command::start && before != nmt::State::operational &&
      before != nmt::State::initialising && application != nullptr &&
      !application->may_operate(time)) {
    ++counters.starts_refused;
    return;
  }
  switch (slave.command(command)) {
    case nmt::Effect::none:
      return;
    case nmt::Effect::state_changed:
      state_changed(before, time);
      return;
    case nmt::Effect::reset_node:
      report_state(before, time);
      reset(true, time);
      return;
    case nmt::Effect::reset_communication:
      report_state(before, time);
      reset(false, time);
      return;
  }
}

void Node::Impl::reset(bool whole_node, Instant time) {
  ++counters.resets;
  pdos.set_operational(false, time);
  sync.set_active(false);
  clock.set_active(false);
  emcy.set_active(false);
  heartbeat.set_state(nmt::State::initialising);
  guarding.set_state(nmt::State::initialising);
  if (whole_node) {
    dictionary.reset_values(0x0001, 0xFFFF);
  } else {
    dictionary.reset_values(od::objects::kFirstCommunication, od::objects::kLastCommunication);
  }
  (void)storage.apply(whole_node);
  if (application != nullptr) {
    application->reset(whole_node, time);
  }
  boot(time);
}

void Node::Impl::boot(Instant time) {
  now = time;
  if (master_services != nullptr) {
    master_services->before_boot(time);
  }
  faults.clear();
  errors.clear();
  device_errors.fill(0);
  reported_count = 0;
  sticky = 0;
  device_temporary = 0;
  duplicate_reported = false;
  sync.configure();
  clock.configure();
  emcy.configure();
  emcy.history().clear();
  emergency_cob_ids.configure();
  heartbeat_times.configure(true);
  configure_sdo();
  (void)pdos.configure();  // pdo_unusable() reports the problems
  guarding.configure();
  heartbeat.boot_up(time);
  slave.booted();
  state_changed(nmt::State::initialising, time);
  if (damage != storage::Damage::none) {
    report_damage(std::exchange(damage, storage::Damage::none));
  }
  if (self_starting()) {
    command(nmt::Command::start, time);
  }
}

bool Node::Impl::self_starting() const {
  const auto startup = dictionary.number(kNmtStartup);
  return options.self_starting ||
         (options.nmt_slave && startup && (*startup & kNotSelfStarting) == 0 &&
          (*startup & (kNmtMaster | kFlyingMaster)) != kNmtMaster);
}

void Node::Impl::state_changed(nmt::State before, Instant time) {
  const nmt::State state = slave.state();
  counters.starts += state == nmt::State::operational ? 1U : 0U;
  heartbeat.set_state(state);
  guarding.set_state(state);
  emcy.set_active(serves(can::Service::emcy));
  sync.set_active(serves(can::Service::sync));
  clock.set_active(serves(can::Service::time));
  if (!serves(can::Service::sdo_server)) {
    reset_sdo();
  }
  pdos.set_operational(state == nmt::State::operational && !suspended, time);
  keep_early_pdos();
  apply_writes(time);
  report_state(before, time);
  if (application != nullptr) {
    application->state_changed(state, time);
  }
  if (master_services != nullptr) {
    master_services->state_changed(state, time);
  }
}

void Node::Impl::keep_early_pdos() {
  pdos.keep_early(!options.nmt_slave && !suspended && slave.state() == nmt::State::pre_operational);
}

void Node::Impl::suspend(Instant time) {
  suspended = true;
  pdos.set_operational(false, time);
  keep_early_pdos();
  guarding.set_suspended(true);
  sync.set_suspended(true);
  stop_monitoring();
}

void Node::Impl::resume() {
  suspended = false;
  guarding.set_suspended(false);
  sync.set_suspended(false);
}

void Node::Impl::stop_monitoring() {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    heartbeats.stop(node);
  }
}

void Node::Impl::report_state(nmt::State before, Instant time) {
  events.emit({.time = time,
               .node = options.node_id,
               .data = event::OwnState{
                   .state = slave.state(), .before = before, .node_id = options.node_id}});
}

void Node::Impl::advance(Instant time) {
  now = time;
  hide_monitored();
  pdos.set_sync_window(sync.window());
  if (suspended) [[unlikely]] {
    stop_monitoring();  // 1016h may have been written
  }
  heartbeats.advance(time);
  guarding.advance(time);
  if (const auto counter = sync.advance(time)) {
    stamp(time);
    sync_queued = time;
    synced(*counter, time);
  }
  clock.advance(time);
  pdos.advance(time);
  sdo.advance(time, transmit);
  sdo_clients.advance(time, transmit);
  if (usdo != nullptr) [[unlikely]] {
    usdo->advance(time, transmit);
    if (dictionary.writes_reported() != applied_writes) {
      apply_writes(time);
    }
  }
  emcy.advance(time);
  heartbeat.advance(time);
}

// Object 1013h of a SYNC producer: the time of the SYNC, in us of its own clock.
void Node::Impl::stamp(Instant time) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch());
  dictionary.set(kHighResolutionStamp, static_cast<std::uint32_t>(us.count()));
}

Instant Node::Impl::next_wake() const {
  return earlier(next_service(), pdos.next_wake());
}

Instant Node::Impl::next_service() const {
  Instant next = earlier(heartbeats.next_wake(), heartbeat.next_wake());
  next = earlier(next, guarding.next_wake());
  next = earlier(next, sync.next_wake());
  next = earlier(next, clock.next_wake());
  next = earlier(next, emcy.next_wake());
  if (usdo != nullptr) [[unlikely]] {
    next = earlier(next, usdo->next_wake());
  }
  return earlier(next, earlier(sdo.next_wake(), sdo_clients.next_wake()));
}

void Node::Impl::apply_writes(Instant time) {
  sync.apply_writes(time);
  pdos.set_sync_window(sync.window());
  clock.apply_writes(time);
  heartbeat.apply_writes(time);
  sdo.apply_writes();
  sdo_clients.apply_writes();
  applied_writes = dictionary.writes_reported();
}

}  // namespace linegate::node
