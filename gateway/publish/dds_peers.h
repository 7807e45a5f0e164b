// SPDX-License-Identifier: Apache-2.0
// Implements PeerClient with bridges/dds: a participant of its own, because it is a client of other
// gateways.
#pragma once

#include <functional>
#include <memory>

#include "gateway/config/plant.h"
#include "gateway/publish/peer_messages.h"
#include "gateway/publish/peer_routes.h"
#include "gateway/publish/process_ends.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {
struct Security;
namespace guard {
struct Stall;
}  // namespace guard
}  // namespace linegate::dds

namespace linegate::gateway {

// The client in this process.
class LocalPeers : public PeerClient {
 public:
  // See dds::SamplePort. longest_stall() from any thread.
  virtual dds::guard::Stall longest_stall() const = 0;
  virtual void watch_timers() = 0;
};

// Without a value, a diagnostic states the reason. add_functions: sets those that settings do not
// contain.
Loaded<std::unique_ptr<LocalPeers>> make_local_peers(
    const PeerSettings& settings, const std::function<void(dds::Security&)>& add_functions);

// With the DDS settings of that plant, in this process or one of its own. nullptr if DDS refuses,
// which is logged. events: receive events of lines. ends: receives those of that process.
std::unique_ptr<PeerClient> make_dds_peers(const config::Plant& plant, bool events,
                                           std::shared_ptr<ProcessEnds> ends);

}  // namespace linegate::gateway
