// SPDX-License-Identifier: Apache-2.0
#include "stack/line/flying_master_service.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/line/build.h"
#include "stack/manager/network_list.h"
#include "stack/od/objects.h"
#include "stack/time/service.h"

namespace linegate::line {
namespace {

constexpr std::uint8_t kPriority = 3;      // of 1F90h
constexpr std::uint8_t kPrioritySlot = 4;  // of 1F90h
constexpr std::uint8_t kDeviceSlot = 5;    // of 1F90h
constexpr std::uint8_t kDetectCycle = 6;   // of 1F90h
constexpr od::Address kSyncProducer{od::objects::kSyncCobId, 0};
constexpr od::Address kTimeProducer{od::objects::kTimeCobId, 0};

std::uint32_t number_of(const od::Dictionary& dictionary, od::Address address) {
  return static_cast<std::uint32_t>(dictionary.number(address).value_or(0));
}

}  // namespace

FlyingMasterService::FlyingMasterService(ServiceHost& host, const LineConfig& config,
                                         const Parts& parts)
    : Service(host), config_(config), parts_(parts), machine_(*this, config.node_id) {
  if (config_.flying_master) {
    machine_.set_detection(config_.flying_master->forces_each_cycle ? nmt::MasterDetection::force
                                                                    : nmt::MasterDetection::ask);
    follow_times();
    LINEGATE_ASSERT(parts_.node.dictionary().set_hook(od::objects::kFlyingMasterTiming, this).ok(),
                    "the object exists");
    parts_.node.set_stored_adjustment(
        [this](storage::StoredValue& value) { adjust_stored(value); });
  }
}

FlyingMasterService::~FlyingMasterService() {
  if (config_.flying_master) {
    LINEGATE_ASSERT(
        parts_.node.dictionary().set_hook(od::objects::kFlyingMasterTiming, nullptr).ok(),
        "the object exists");
    parts_.node.set_stored_adjustment({});
  }
}

bool FlyingMasterService::takes_part() const {
  using namespace manager::startup;
  constexpr std::uint32_t kBoth = kMaster | kFlyingMaster;
  return config_.flying_master &&
         (number_of(parts_.node.dictionary(), {od::objects::kNmtStartup, 0}) & kBoth) == kBoth;
}

void FlyingMasterService::advance(Instant now) {
  if (!config_.flying_master) {
    return;
  }
  follow_times();
  if (host().is_running() && takes_part() != competes()) {
    if (competes()) {
      machine_.stop(now);
    } else {
      machine_.start(true, now);
    }
  }
  if (!hold(now)) {
    machine_.advance(now);
  }
  look_at_ = machine_.is_master() || held_ ? now + FramesUnderWay::kStuck : kNever;
  follow_producers();  // they may have been written meanwhile
}

Instant FlyingMasterService::next_wake() const {
  return held_ ? look_at_ : earlier(machine_.next_wake(), look_at_);
}

void FlyingMasterService::probed(Instant now) {
  constexpr Duration kPause = std::chrono::seconds(1);
  probe_at_ = now + kPause;
}

// While the bus accepts no frames, no answer means nothing, and what the node decides would be the
// first frames in a network that has another master: the state machine is held, and then searches
// again without a reset. The active master keeps its role until the others miss its heartbeat.
bool FlyingMasterService::hold(Instant now) {
  // Before a decision: the question itself may not have been sent.
  const bool decides = !machine_.is_master() && machine_.next_wake() <= now;
  const bool cut_off =
      competes() && host().bus_is_stuck(decides ? now + FramesUnderWay::kStuck / 2 : now);
  cut_since_ = cut_off ? earlier(cut_since_, now) : kNever;
  if (cut_off && machine_.is_master() && now - cut_since_ < master_time()) {
    return false;
  }
  if (std::exchange(held_, cut_off) != cut_off && competes()) {
    machine_.start(false, now);
    (void)parts_.node.transmit().remove(can::TransmitClass::nmt, [](const can::Frame& frame) {
      return frame.id >= nmt::kActiveMasterId && frame.id <= nmt::kForceNegotiationId;
    });
  }
  if (held_ && host().usable() && may_probe(now)) {
    send_master_message({.id = nmt::kDetectMasterId}, now);  // there may be nothing else to send
  }
  return held_;
}

void FlyingMasterService::start(Instant now) {
  if (takes_part()) {
    machine_.start(true, now);
  }
}

void FlyingMasterService::stop(Instant now) {
  if (config_.flying_master) {
    machine_.stop(now);
  }
}

void FlyingMasterService::boot(Instant now) {
  if (!config_.flying_master) {
    return;
  }
  master_entry_ = 0;
  produces_ = true;
  follow_times();
  if (takes_part()) {
    machine_.start(false, now);
  } else {
    machine_.stop(now);
  }
  follow_producers();
}

bool FlyingMasterService::receive(const can::Frame& frame) {
  return machine_.receive(frame);
}

// Each message is at most once in the queue: those of the time in which the bus accepted none
// would all be sent afterwards.
void FlyingMasterService::send_master_message(const can::Frame& frame, Instant /*now*/) {
  can::TransmitQueue& queue = parts_.node.transmit();
  if (!queue.holds(can::TransmitClass::nmt, {frame.id, frame.length, frame.flags})) {
    (void)queue.push(can::TransmitClass::nmt, frame);
  }
}

bool FlyingMasterService::reset_all(Instant now) {
  constexpr auto kCommand = nmt::Command::reset_communication;
  const manager::NetworkList list(parts_.node.dictionary());
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (list.has(id, manager::assignment::kListed | manager::assignment::kKeepAlive)) {
      return false;
    }
  }
  if (!manager_options(config_).reset_nodes) {
    return false;
  }
  if (!parts_.node.transmit().push(can::TransmitClass::nmt, nmt::encode({kCommand, 0}))) {
    return false;
  }
  parts_.nmt_host.nmt_sent(kCommand, 0, now);
  parts_.manager.heard(kCommand, 0);
  return true;
}

void FlyingMasterService::flying_master_changed(nmt::FlyingMasterState before, Instant now) {
  parts_.events.emit(
      {.time = now,
       .node = machine_.active_master(),
       .data = event::FlyingMaster{
           .state = machine_.state(), .before = before, .priority = machine_.own_rank().priority}});
  forget_master();
  if (machine_.state() == nmt::FlyingMasterState::slave) {
    monitor_master();
  }
  if (!machine_.is_master()) {  // what waits for the bus would not be true any more
    const bool resets = machine_.state() == nmt::FlyingMasterState::reset;
    (void)parts_.node.transmit().remove(can::TransmitClass::nmt, [resets](const can::Frame& frame) {
      return frame.id == nmt::kActiveMasterId || (frame.id == can::kNmtId && !resets);
    });
  }
  follow_producers();
}

AbortCode FlyingMasterService::check_write(od::Address address, std::span<const std::byte> value) {
  const auto number = static_cast<std::uint32_t>(load_le(value));
  const od::Dictionary& dictionary = parts_.node.dictionary();
  const auto other = [&](std::uint8_t sub) { return number_of(dictionary, {address.index, sub}); };
  bool good = number != 0;  // without a time there is no answer in time
  if (address.sub == kPriority) {
    good = number <= nmt::kLowestMasterPriority;
  } else if (address.sub == kPrioritySlot) {
    good = number > can::kMaxNodeId * other(kDeviceSlot);
  } else if (address.sub == kDeviceSlot) {
    good = good && other(kPrioritySlot) > can::kMaxNodeId * number;
  }
  return good ? AbortCode::none : AbortCode::invalid_value;
}

void FlyingMasterService::follow_times() {
  const auto ms = [this](std::uint8_t sub) {
    return std::chrono::milliseconds(
        number_of(parts_.node.dictionary(), {od::objects::kFlyingMasterTiming, sub}));
  };
  machine_.set_times({.master_timeout = ms(1),
                      .negotiation_delay = ms(2),
                      .priority = static_cast<std::uint8_t>(ms(kPriority).count()),
                      .priority_slot = ms(4),
                      .device_slot = ms(5),
                      .detect_cycle = ms(kDetectCycle)});
}

// The active master produces SYNC and TIME, if it is configured to.
void FlyingMasterService::follow_producers() {
  if (!competes() && !host().is_running()) {
    return;
  }
  const bool wanted = !is_passive();
  const bool before = std::exchange(produces_, wanted);
  if (wanted && before) {
    return;
  }
  od::Dictionary& dictionary = parts_.node.dictionary();
  const OwnObjects::OwnWrites by_itself(parts_.own_objects);
  const std::uint32_t sync = number_of(dictionary, kSyncProducer);
  const std::uint32_t time = number_of(dictionary, kTimeProducer);
  const bool has_sync = (sync & can::CobId::kProducerBit) != 0;
  const bool has_time = (time & time::kProduceBit) != 0;
  if (!wanted) {
    sync_ = has_sync || (sync_ && !before);
    time_ = has_time || (time_ && !before);
    consumes_time_ = has_time ? (time & time::kConsumeBit) != 0 : consumes_time_;
  }
  if (wanted ? sync_ : has_sync) {
    dictionary.set(kSyncProducer,
                   wanted ? sync | can::CobId::kProducerBit : sync & ~can::CobId::kProducerBit);
  }
  if (wanted ? time_ : has_time) {
    const std::uint32_t alone = time & ~time::kConsumeBit & ~time::kProduceBit;
    const std::uint32_t consumes = consumes_time_ ? time::kConsumeBit : 0U;
    dictionary.set(kTimeProducer,
                   wanted ? alone | time::kProduceBit | consumes : alone | time::kConsumeBit);
  }
}

// What a slave suppresses, and its entry of the active master, are not stored.
void FlyingMasterService::adjust_stored(storage::StoredValue& value) const {
  const od::Address entry{od::objects::kConsumerHeartbeatTime, master_entry_};
  auto number = static_cast<std::uint32_t>(load_le(std::span(value.data)));
  if (value.address == kSyncProducer && !produces_ && sync_) {
    number |= can::CobId::kProducerBit;
  } else if (value.address == kTimeProducer && !produces_ && time_) {
    number = (consumes_time_ ? number : number & ~time::kConsumeBit) | time::kProduceBit;
  } else if (value.address == entry && master_entry_ != 0 && number == master_value_) {
    number = 0;
  } else {
    return;
  }
  store_le(std::span(value.data), number);
}

// The consumer heartbeat time of the active master. Another flying master has its own, but all of a
// network should have the same. Without a heartbeat the others ask after a detect cycle.
Duration FlyingMasterService::master_time() const {
  const Duration time = consumer_time_of_master();
  return time != Duration::zero() ? time : machine_.times().detect_cycle;
}

Duration FlyingMasterService::consumer_time_of_master() const {
  constexpr Duration kLongest = std::chrono::milliseconds(0xFFFF);
  const Duration own = std::chrono::milliseconds(
      number_of(parts_.node.dictionary(), {od::objects::kProducerHeartbeatTime, 0}));
  const Duration configured = config_.flying_master->master_heartbeat;
  return std::min(configured != Duration::zero() ? configured : 2 * own, kLongest);
}

// An entry for the active master in 1016h, unless there is one.
void FlyingMasterService::monitor_master() {
  od::Dictionary& dictionary = parts_.node.dictionary();
  const Duration time = consumer_time_of_master();
  if (time == Duration::zero()) {
    return;
  }
  if (has_entry_of_master()) {
    return;
  }
  std::uint8_t unused = 0;
  const unsigned highest = dictionary.highest_sub(od::objects::kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = highest; sub >= 1; --sub) {
    const auto place = static_cast<std::uint8_t>(sub);
    if (number_of(dictionary, {od::objects::kConsumerHeartbeatTime, place}) == 0) {
      unused = place;
    }
  }
  if (unused == 0) {
    return;
  }
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
  master_entry_ = unused;
  master_value_ = std::uint32_t{machine_.active_master()} << 16U | static_cast<std::uint32_t>(ms);
  const OwnObjects::OwnWrites by_itself(parts_.own_objects);
  dictionary.set({od::objects::kConsumerHeartbeatTime, unused}, master_value_);
}

bool FlyingMasterService::has_entry_of_master() const {
  const od::Dictionary& dictionary = parts_.node.dictionary();
  const unsigned highest = dictionary.highest_sub(od::objects::kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = 1; sub <= highest; ++sub) {
    const std::uint32_t value = number_of(
        dictionary, {od::objects::kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub)});
    if ((value >> 16U & 0xFFU) == machine_.active_master() && (value & 0xFFFFU) != 0) {
      return true;
    }
  }
  return false;
}

void FlyingMasterService::forget_master() {
  const od::Address entry{od::objects::kConsumerHeartbeatTime, std::exchange(master_entry_, 0)};
  od::Dictionary& dictionary = parts_.node.dictionary();
  if (entry.sub != 0 && number_of(dictionary, entry) == master_value_) {
    const OwnObjects::OwnWrites by_itself(parts_.own_objects);
    dictionary.set(entry, std::uint32_t{0});
  }
}

}  // namespace linegate::line
