// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/scan/describe.h"

namespace linegate::scan {
namespace {

constexpr od::Address kGuardTime{od::objects::kGuardTime, 0};
constexpr od::Address kLifeTimeFactor{od::objects::kLifeTimeFactor, 0};
constexpr od::Address kHeartbeat{od::objects::kProducerHeartbeatTime, 0};
constexpr od::Address kInputsSent{od::objects::cia401::kAnalogueInterrupts, 0};
constexpr std::uint64_t kUsualFactor = 4;  // missed answers until a node counts as lost

// No effect on values that were not read.
void set(ScannedNode& node, od::Address address, std::uint64_t value) {
  const auto known = std::ranges::find(node.values, address, &manager::ObjectWrite::address);
  if (known != node.values.end()) {
    store_le(std::span(known->data), value);
  }
}

void set_up_error_control(ScannedNode& node, std::uint64_t milliseconds) {
  const auto heartbeat = node.number(kHeartbeat);
  const auto guard_time = node.number(kGuardTime);
  const auto factor = node.number(kLifeTimeFactor);
  const bool guarded = guard_time.value_or(0) != 0 && factor.value_or(0) != 0;
  if (guarded || heartbeat.value_or(0) != 0) {
    return;
  }
  if (heartbeat) {
    set(node, kHeartbeat, milliseconds);
  } else if (guard_time && factor) {
    set(node, kGuardTime, milliseconds);
    set(node, kLifeTimeFactor, kUsualFactor);
  }
}

}  // namespace

void set_up(std::span<ScannedNode> nodes, Duration heartbeat) {
  const auto time = std::chrono::duration_cast<std::chrono::milliseconds>(heartbeat);
  for (ScannedNode& node : nodes) {
    set_up_error_control(node, static_cast<std::uint64_t>(time.count()));
    set(node, kInputsSent, 1);
  }
}

}  // namespace linegate::scan
