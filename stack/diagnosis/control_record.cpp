// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/control_record.h"

#include <algorithm>
#include <chrono>
#include <span>

#include "stack/diagnosis/record_description.h"

namespace linegate::diagnosis {
namespace {

using std::chrono::milliseconds;

// 0Bh: bits 0..3 transmit, bits 4..7 receive; each 0 off, 1 by the frame record.
constexpr std::uint64_t kSendsFrames = 0x01;
constexpr std::uint64_t kReceivesFrames = 0x10;

std::uint64_t in_ms(Duration time, std::uint64_t longest) {
  return std::min(static_cast<std::uint64_t>(time / milliseconds(1)), longest);
}

std::uint64_t control_of(const ControlSettings& settings) {
  std::uint32_t out = kFixedControl;
  out |= settings.keep_operational ? kKeepOperational : 0U;
  out |= settings.use_scanned_entries ? kUseScannedEntries : 0U;
  out |= settings.enforce_sdo ? kEnforceSdo : 0U;
  out |= settings.manual_trigger ? kManualTrigger : 0U;
  return out;
}

std::uint64_t generic_can_of(const ControlSettings& settings) {
  return (settings.sends_frames ? kSendsFrames : 0U) |
         (settings.receives_frames ? kReceivesFrames : 0U);
}

}  // namespace

od::ObjectDescription control_record(std::uint16_t index) {
  using od::Access;
  using od::DataType;
  constexpr std::uint8_t kShortest = 1;  // heartbeat producer time, ms
  const auto usual =
      std::chrono::duration_cast<std::chrono::milliseconds>(ControlSettings{}.heartbeat);
  od::VariableDescription heartbeat =
      od::number_variable(kHeartbeatSub, "Default heartbeat producer time", DataType::unsigned16,
                          Access::rw, static_cast<std::uint64_t>(usual.count()));
  heartbeat.low_limit.resize(heartbeat.value.size());
  store_le(std::span(heartbeat.low_limit), std::uint64_t{kShortest});
  return record(
      index, "Device control",
      {od::number_variable(kResetSub, "Reset", DataType::unsigned8, Access::wo),
       od::number_variable(kSleepObjectionSub, "Sleep objection", DataType::unsigned8, Access::rw),
       od::number_variable(kManagerControlSub, "Manager control", DataType::unsigned32, Access::rw),
       heartbeat,
       od::number_variable(kHeartbeatConsumerSub, "Default heartbeat consumer time",
                           DataType::unsigned16, Access::ro),
       od::number_variable(kUpdateTimeSub, "Default PDO update time", DataType::unsigned8,
                           Access::rw),
       od::number_variable(kEventTimeSub, "Default PDO event time", DataType::unsigned16,
                           Access::rw),
       od::number_variable(kInhibitTimeSub, "Default PDO inhibit time", DataType::unsigned16,
                           Access::rw),
       od::number_variable(kScanSub, "Scan of a node", DataType::unsigned8, Access::wo),
       od::number_variable(kGenericCanSub, "Generic CAN", DataType::unsigned8, Access::rw),
       od::number_variable(kTriggerSub, "PDO trigger", DataType::unsigned16, Access::wo)});
}

std::uint64_t read_setting(const ControlSettings& settings, std::uint8_t sub) {
  constexpr std::uint64_t kLongest8 = 0xFF;
  constexpr std::uint64_t kLongest16 = 0xFFFF;
  switch (sub) {
    case kSleepObjectionSub:
      return settings.sleep_objection ? 1 : 0;
    case kManagerControlSub:
      return control_of(settings);
    case kHeartbeatSub:
      return in_ms(settings.heartbeat, kLongest16);
    case kHeartbeatConsumerSub:
      return in_ms(settings.heartbeat * 5 / 2, kLongest16);
    case kUpdateTimeSub:
      return in_ms(settings.update_time, kLongest8);
    case kEventTimeSub:
      return settings.event_time.value_or(0);
    case kInhibitTimeSub:
      return settings.inhibit_time.value_or(0);
    default:
      return generic_can_of(settings);
  }
}

AbortCode check_setting(const ControlSettings& settings, std::uint8_t sub, std::uint64_t value) {
  bool good = true;
  if (sub == kManagerControlSub) {
    good = (value | kWritableControl) == (control_of(settings) | kWritableControl);
  } else if (sub == kSleepObjectionSub) {
    good = value <= 1;
  } else if (sub == kGenericCanSub) {
    good = (value & ~(kSendsFrames | kReceivesFrames)) == 0;
  }
  return good ? AbortCode::none : AbortCode::invalid_value;
}

void write_setting(ControlSettings& settings, std::uint8_t sub, std::uint64_t value) {
  const auto has = [value](std::uint64_t bit) { return (value & bit) != 0; };
  switch (sub) {
    case kSleepObjectionSub:
      settings.sleep_objection = value != 0;
      return;
    case kManagerControlSub:
      settings.keep_operational = has(kKeepOperational);
      settings.use_scanned_entries = has(kUseScannedEntries);
      settings.enforce_sdo = has(kEnforceSdo);
      settings.manual_trigger = has(kManualTrigger);
      return;
    case kHeartbeatSub:
      settings.heartbeat = milliseconds(value);
      return;
    case kUpdateTimeSub:
      settings.update_time = milliseconds(value);
      return;
    case kEventTimeSub:
      settings.event_time = static_cast<std::uint16_t>(value);
      return;
    case kInhibitTimeSub:
      settings.inhibit_time = static_cast<std::uint16_t>(value);
      return;
    default:
      settings.sends_frames = has(kSendsFrames);
      settings.receives_frames = has(kReceivesFrames);
      return;
  }
}

}  // namespace linegate::diagnosis
