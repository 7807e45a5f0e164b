// SPDX-License-Identifier: Apache-2.0
// Implements PeerClient with bridges/dds: a participant of its own, because it is a client of other
// gateways.
#pragma once

#include <memory>

#include "gateway/config/plant.h"
#include "gateway/publish/peer_routes.h"

namespace linegate::gateway {

// With the DDS settings of that plant. nullptr if DDS refuses, which is logged.
std::unique_ptr<PeerClient> make_dds_peers(const config::Plant& plant);

}  // namespace linegate::gateway
