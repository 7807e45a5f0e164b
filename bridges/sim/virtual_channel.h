// SPDX-License-Identifier: Apache-2.0
// The channel "virtual:NAME": an endpoint of a bus inside this process, in real time.
//
// Several threads may hold channels of one bus: a mutex guards the bus, and each channel's
// descriptor is a timer that expires when the next frame ends on the wire. No thread drives the
// bus; each read and write advances it.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "bridges/can/channel.h"
#include "bridges/can/virtual_faults.h"
#include "bridges/sim/bus.h"

namespace linegate::sim {

// The named buses of one process. It must outlive every call of open(); channels keep their bus
// alive. Thread-safe.
class VirtualNetwork {
 public:
  VirtualNetwork();
  ~VirtualNetwork();
  VirtualNetwork(const VirtualNetwork&) = delete;
  VirtualNetwork& operator=(const VirtualNetwork&) = delete;

  // Opens an endpoint of the bus with that name. The first endpoint creates the bus with its
  // options. Faults of the bus replace those that another endpoint configured.
  std::unique_ptr<can_bridge::Channel> open(std::string_view name, const BusOptions& options = {},
                                            const can_bridge::VirtualFaults& faults = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::sim
