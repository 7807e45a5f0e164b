// SPDX-License-Identifier: Apache-2.0
// The last known status of each node, with the numbers of the CANopenIA manual (6.3,
// NODESTATUS_...).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "stack/base/event.h"
#include "stack/can/cob_id.h"
#include "stack/nmt/state.h"

namespace linegate::diagnosis {

inline constexpr std::uint8_t kStatusBoot =
    0x00;  // boot-up message; else the NMT state: 04h, 05h, 7Fh
inline constexpr std::uint8_t kStatusEmcyNew = 0x80;
inline constexpr std::uint8_t kStatusEmcyOver = 0x81;
inline constexpr std::uint8_t kStatusHeartbeatActive = 0x90;
inline constexpr std::uint8_t kStatusHeartbeatLost = 0x91;
inline constexpr std::uint8_t kStatusScanStarted = 0x9F;
inline constexpr std::uint8_t kStatusScanComplete = 0xA0;
inline constexpr std::uint8_t kStatusScanAborted = 0xA8;
inline constexpr std::uint8_t kStatusResetApplication = 0xB0;
inline constexpr std::uint8_t kStatusResetCommunication = 0xB1;
inline constexpr std::uint8_t kStatusSleep = 0xF0;

class NodeStatus {
 public:
  void note(const Event& event);
  // An NMT command was sent to a node, or to all nodes with a known status with 0. Resets are a
  // status.
  void commanded(nmt::Command command, std::uint8_t node);
  // All nodes with a known status sleep.
  void fell_asleep() { set(0, kStatusSleep); }
  // A scan of a node began, or of all with 0.
  void scan_begins(std::uint8_t node);
  // The scan ended: nodes without a result are absent.
  void scan_ends();

  // node: 1..127. Nothing if there is no status.
  std::optional<std::uint8_t> of(std::uint8_t node) const { return last_[node]; }

 private:
  void set(std::uint8_t node, std::uint8_t status);

  std::array<std::optional<std::uint8_t>, can::kMaxNodeId + 1> last_{};
};

}  // namespace linegate::diagnosis
