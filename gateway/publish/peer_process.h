// SPDX-License-Identifier: Apache-2.0
// The client of other gateways in a process of its own (`dds: {process: own}`): both ends. It is
// another process than that of the gateway's own endpoints, so each continues when the other ends.
#pragma once

#include <memory>
#include <string_view>

#include "gateway/config/plant.h"
#include "gateway/publish/peer_messages.h"
#include "gateway/publish/peer_routes.h"
#include "gateway/publish/process_ends.h"

namespace linegate::gateway {

// nullptr if no process can be started, which is logged. Does not wait for DDS. ends: receives
// those of the process.
std::unique_ptr<PeerClient> make_peer_process(const config::Plant& plant,
                                              const PeerSettings& settings,
                                              std::shared_ptr<ProcessEnds> ends);

// The only argument of a program that shall call run_peer_process() first in main().
inline constexpr std::string_view kPeerProcessArgument = "--dds-routes-process";
[[noreturn]] void run_peer_process();

}  // namespace linegate::gateway
