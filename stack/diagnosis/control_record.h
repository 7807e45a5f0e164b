// SPDX-License-Identifier: Apache-2.0
// The control record of the CANopenIA manual (6.2): the settings of the manager. The bits and bytes
// of its sub-indices are listed in canopen_ia.h.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::diagnosis {

// Sub-indices of the record.
inline constexpr std::uint8_t kResetSub = 0x01;
inline constexpr std::uint8_t kSleepObjectionSub = 0x02;
inline constexpr std::uint8_t kManagerControlSub = 0x04;
inline constexpr std::uint8_t kHeartbeatSub = 0x05;
inline constexpr std::uint8_t kHeartbeatConsumerSub = 0x06;
inline constexpr std::uint8_t kUpdateTimeSub = 0x07;
inline constexpr std::uint8_t kEventTimeSub = 0x08;
inline constexpr std::uint8_t kInhibitTimeSub = 0x09;
inline constexpr std::uint8_t kScanSub = 0x0A;
inline constexpr std::uint8_t kGenericCanSub = 0x0B;
inline constexpr std::uint8_t kTriggerSub = 0x0C;

// Writable bits of the manager control.
inline constexpr std::uint32_t kKeepOperational = 1U << 0U;
inline constexpr std::uint32_t kUseScannedEntries = 1U << 4U;
inline constexpr std::uint32_t kEnforceSdo = 1U << 5U;
inline constexpr std::uint32_t kManualTrigger = 1U << 6U;
inline constexpr std::uint32_t kWritableControl =
    kKeepOperational | kUseScannedEntries | kEnforceSdo | kManualTrigger;
// The other bits are fixed: all heartbeats and PDOs of configured nodes are received and sent, of
// up to 127 nodes.
inline constexpr std::uint32_t kFixedControl =
    1U << 1U | 1U << 2U | 1U << 3U | 127U << 16U | 127U << 24U;

struct ControlSettings {
  bool sleep_objection = false;      // the own node objects to sleep
  bool keep_operational = false;     // restart a started node that shows another state
  bool use_scanned_entries = false;  // answer reads with scanned values
  bool enforce_sdo = false;          // writes by object use SDO
  bool manual_trigger = false;       // PDOs written by object are sent only when triggered
  Duration heartbeat = std::chrono::milliseconds(500);  // LineConfig::found_heartbeat
  Duration update_time{};                               // LineConfig::pdo_update_time
  // Of event-driven TPDOs, in ms and in 100 us; without a value the configured times apply.
  std::optional<std::uint16_t> event_time{};
  std::optional<std::uint16_t> inhibit_time{};
  bool sends_frames = false;     // by writes to the frame record
  bool receives_frames = false;  // frames that no service consumes
};

od::ObjectDescription control_record(std::uint16_t index);

// The value of a sub-index of the record that holds a setting. Precondition of writing: the value
// was checked.
std::uint64_t read_setting(const ControlSettings& settings, std::uint8_t sub);
AbortCode check_setting(const ControlSettings& settings, std::uint8_t sub, std::uint64_t value);
void write_setting(ControlSettings& settings, std::uint8_t sub, std::uint64_t value);

}  // namespace linegate::diagnosis
