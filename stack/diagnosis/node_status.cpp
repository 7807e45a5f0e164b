// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/node_status.h"

namespace linegate::diagnosis {

void NodeStatus::note(const Event& event) {
  if (event.node < can::kMinNodeId || event.node > can::kMaxNodeId) {
    return;
  }
  std::optional<std::uint8_t>& last = last_[event.node];
  switch (event.kind) {
    case EventKind::boot_up:
      last = kStatusBoot;
      return;
    case EventKind::node_state:
      last = static_cast<std::uint8_t>(event.code);
      return;
    case EventKind::emcy:
      last = event.code == 0 ? kStatusEmcyOver : kStatusEmcyNew;
      return;
    case EventKind::heartbeat_lost:
      last = kStatusHeartbeatLost;
      return;
    case EventKind::heartbeat_recovered:
      last = kStatusHeartbeatActive;
      return;
    case EventKind::node_scanned:
      last = event.code == 0 ? kStatusScanComplete : kStatusScanAborted;
      return;
    default:
      return;
  }
}

void NodeStatus::set(std::uint8_t node, std::uint8_t status) {
  if (node != 0) {
    last_[node] = status;
    return;
  }
  for (std::optional<std::uint8_t>& last : last_) {
    last = last ? std::optional(status) : last;
  }
}

void NodeStatus::commanded(nmt::Command command, std::uint8_t node) {
  if (command == nmt::Command::reset_node) {
    set(node, kStatusResetApplication);
  } else if (command == nmt::Command::reset_communication) {
    set(node, kStatusResetCommunication);
  }
}

void NodeStatus::scan_begins(std::uint8_t node) {
  set(node, kStatusScanStarted);
}

void NodeStatus::scan_ends() {
  for (std::optional<std::uint8_t>& last : last_) {
    last = last == kStatusScanStarted ? std::optional(kStatusScanAborted) : last;
  }
}

}  // namespace linegate::diagnosis
