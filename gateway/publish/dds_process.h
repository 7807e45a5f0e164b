// SPDX-License-Identifier: Apache-2.0
// DDS in a process of its own: both ends.
#pragma once

#include <memory>
#include <string_view>

#include "gateway/config/plant.h"
#include "gateway/exchange/bell.h"
#include "gateway/publish/process_ends.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {
class GatewayBridge;
class SharedFiles;
struct GatewayOptions;
}  // namespace linegate::dds

namespace linegate::gateway {

class DirectImages;

// For GatewayBridge::share_images() of that bridge.
std::shared_ptr<dds::SharedFiles> shared_files(std::shared_ptr<DirectImages> images);

// bell: wakes the process. Starts the process and waits until it has created the endpoints, at most
// 3 s, and no longer than to a stop signal (runtime/signals.h); the lines must not depend on it.
// Each end of a process is noted in `ends`. Without a value, a diagnostic states the reason: an
// error in the configuration, or no process can be started.
Loaded<std::unique_ptr<dds::GatewayBridge>> make_bridge_to_process(
    const dds::GatewayOptions& options, const config::Plant& plant,
    std::shared_ptr<ProcessEnds> ends, std::shared_ptr<exchange::Bell> bell);

}  // namespace linegate::gateway
