// SPDX-License-Identifier: Apache-2.0
// The channel "virtual:NAME": an end of a bus inside this process, in real time.
//
// Several threads may hold channels of one bus: the bus is guarded by a mutex, and each channel's
// descriptor is a timer that expires when the next frame ends on the wire. No thread drives the
// bus; whoever reads or writes brings it up to date.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "bridges/can/channel.h"
#include "bridges/can/virtual_faults.h"
#include "bridges/sim/bus.h"

namespace linegate::sim {

// The named buses of one process. Must not be destroyed before other threads' open() has returned;
// channels keep their bus alive themselves. May be used from several threads.
class VirtualNetwork {
 public:
  VirtualNetwork();
  ~VirtualNetwork();
  VirtualNetwork(const VirtualNetwork&) = delete;
  VirtualNetwork& operator=(const VirtualNetwork&) = delete;

  // A new end of the bus with that name; the first to name a bus makes it, with its options. Faults
  // of the bus replace those that another end has asked for.
  std::unique_ptr<can_bridge::Channel> open(std::string_view name, const BusOptions& options = {},
                                            const can_bridge::VirtualFaults& faults = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::sim
