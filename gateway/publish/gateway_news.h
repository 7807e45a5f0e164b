// SPDX-License-Identifier: Apache-2.0
// Events of the gateway itself, to the publisher.
#pragma once

#include <cstdint>
#include <string>

#include "gateway/config/plan_difference.h"
#include "gateway/publish/values.h"
#include "stack/base/event.h"

namespace linegate::gateway {

// From the main thread.
struct GatewayNews {
  Event event;       // its number is assigned when it is published
  std::string text;  // description of the event
  GatewayInfo info;  // state after the event; the publisher adds counters and discovery
};

// An event of the gateway that changes nothing, from the request receiver to the publisher.
struct GatewayNotice {
  Event event;  // as in GatewayNews
  std::string text;
};

// Hash of the configuration. Two configurations have the same hash with a probability of 2^-64.
std::uint64_t configuration_hash(const config::PlantIdentity& identity);

}  // namespace linegate::gateway
