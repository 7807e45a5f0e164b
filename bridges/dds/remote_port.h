// SPDX-License-Identifier: Apache-2.0
// A gateway whose endpoints are in another process, see port_server.h.
//
// It keeps what the next process must receive when the present one ends: the newest state, layout
// and image of each instance, the last events and replies, and everything else that the process has
// not carried out yet. Samples that were written before may then be written again, with the same
// numbers. write() never waits: while no process accepts messages, newer states replace older ones.
#pragma once

#include <functional>
#include <memory>

#include "bridges/dds/message_link.h"
#include "bridges/dds/publisher.h"

namespace linegate::dds {

// Waits until the endpoints exist, at most `patience`, or until stop() is true, which is called
// several times a second. After that the bridge works without endpoints until a process creates
// them; an entry of the log reports it. Without a value, a process has reported why it cannot
// create them: an error in the configuration.
Loaded<std::unique_ptr<GatewayBridge>> make_remote_bridge(const GatewayOptions& options,
                                                          std::unique_ptr<MessageLink> link,
                                                          Duration patience,
                                                          const std::function<bool()>& stop);

}  // namespace linegate::dds
