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

constexpr std::uint8_t kPriority = 3;     // of 1F90h
constexpr std::uint8_t kDetectCycle = 6;  // of 1F90h
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
  }
}

FlyingMasterService::~FlyingMasterService() {
  if (config_.flying_master) {
    LINEGATE_ASSERT(
        parts_.node.dictionary().set_hook(od::objects::kFlyingMasterTiming, nullptr).ok(),
        "the object exists");
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
  machine_.advance(now);
  follow_producers();  // they may have been written meanwhile
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
  (void)parts_.node.transmit().push(can::TransmitClass::nmt, nmt::encode({kCommand, 0}));
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
  follow_producers();
}

AbortCode FlyingMasterService::check_write(od::Address address, std::span<const std::byte> value) {
  const std::uint64_t number = load_le(value);
  const bool good = address.sub == kPriority      ? number <= nmt::kLowestMasterPriority
                    : address.sub == kDetectCycle ? number != 0
                                                  : true;
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
  }
  if (wanted ? sync_ : has_sync) {
    dictionary.set(kSyncProducer,
                   wanted ? sync | can::CobId::kProducerBit : sync & ~can::CobId::kProducerBit);
  }
  if (wanted ? time_ : has_time) {
    dictionary.set(kTimeProducer, wanted ? (time & ~time::kConsumeBit) | time::kProduceBit
                                         : (time & ~time::kProduceBit) | time::kConsumeBit);
  }
}

// An entry for the active master in 1016h, unless there is one.
void FlyingMasterService::monitor_master() {
  constexpr Duration kLongest = std::chrono::milliseconds(0xFFFF);
  od::Dictionary& dictionary = parts_.node.dictionary();
  const Duration own =
      std::chrono::milliseconds(number_of(dictionary, {od::objects::kProducerHeartbeatTime, 0}));
  const Duration configured = config_.flying_master->master_heartbeat;
  const Duration time = std::min(configured != Duration::zero() ? configured : 2 * own, kLongest);
  if (time == Duration::zero()) {
    return;
  }
  std::uint8_t unused = 0;
  const unsigned highest = dictionary.highest_sub(od::objects::kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = highest; sub >= 1; --sub) {
    const auto place = static_cast<std::uint8_t>(sub);
    const std::uint32_t value = number_of(dictionary, {od::objects::kConsumerHeartbeatTime, place});
    if ((value >> 16U & 0xFFU) == machine_.active_master() && (value & 0xFFFFU) != 0) {
      return;
    }
    unused = value == 0 ? place : unused;
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

void FlyingMasterService::forget_master() {
  const od::Address entry{od::objects::kConsumerHeartbeatTime, std::exchange(master_entry_, 0)};
  od::Dictionary& dictionary = parts_.node.dictionary();
  if (entry.sub != 0 && number_of(dictionary, entry) == master_value_) {
    const OwnObjects::OwnWrites by_itself(parts_.own_objects);
    dictionary.set(entry, std::uint32_t{0});
  }
}

}  // namespace linegate::line
