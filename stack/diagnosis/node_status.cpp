// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/node_status.h"

namespace linegate::diagnosis {

void NodeStatus::note(const Event& event) {
  if (event.node < can::kMinNodeId || event.node > can::kMaxNodeId) {
    return;
  }
  std::optional<std::uint8_t>& last = last_[event.node];
  if (const auto* const change = event.get<event::NodeState>()) {
    last = static_cast<std::uint8_t>(change->state);
  } else if (const auto* const emcy = event.get<event::Emcy>()) {
    last = emcy->code == 0 ? kStatusEmcyOver : kStatusEmcyNew;
  } else if (const auto* const scanned = event.get<event::NodeScanned>()) {
    last = scanned->abort == AbortCode::none ? kStatusScanComplete : kStatusScanAborted;
  } else if (event.get<event::BootUp>() != nullptr) {
    last = kStatusBoot;
  } else if (event.get<event::HeartbeatLost>() != nullptr) {
    last = kStatusHeartbeatLost;
  } else if (event.get<event::HeartbeatRecovered>() != nullptr) {
    last = kStatusHeartbeatActive;
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
