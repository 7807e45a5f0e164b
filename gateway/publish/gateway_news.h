// SPDX-License-Identifier: Apache-2.0
// An event of the gateway itself, from the main thread to the publisher.
#pragma once

#include <cstdint>
#include <string>

#include "gateway/config/plan_difference.h"
#include "gateway/publish/values.h"
#include "stack/base/event.h"

namespace linegate::gateway {

struct GatewayNews {
  Event event;       // its number is given when it is published
  std::string text;  // in words
  GatewayInfo info;  // as it is from then on; counters and discovery are the publisher's
};

// Of the configuration: another one has another hash, but for a chance of 1 to 2^64.
std::uint64_t configuration_hash(const config::PlantIdentity& identity);

}  // namespace linegate::gateway
