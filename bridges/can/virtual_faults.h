// SPDX-License-Identifier: Apache-2.0
// Faults on request: the options of "virtual:NAME".
//
//   virtual:press?lost=1%                   of all frames on the bus so many reach nobody
//   virtual:press?disturbed=0.5%&seed=7     so many are destroyed by an error frame, and sent again
//   virtual:press?doubled=0.1%              so many arrive twice
//   virtual:press?stuck=5@10s               node 5 is stuck after 10 s, for 10 s, and so on
//   virtual:press?stuck=5@always            node 5 is stuck
//   virtual:press?bus_off=10s               this end goes bus-off every 10 s, for a second
//   virtual:press?bus_off=10s&restart=never and stays there until it is told to restart
//
// All but the last two are about the whole bus, whichever of its ends asks for them; the same seed
// and the same frames give the same faults. Of a node that is stuck nothing reaches anybody that it
// sends on the identifiers of the pre-defined connection set: EMCY, TPDO 1 to 4, SDO, heartbeat.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "bridges/can/interface_uri.h"
#include "stack/base/time.h"

namespace linegate::can_bridge {

struct VirtualFaults {
  double lost = 0;       // 0 to 1, together at most 1
  double disturbed = 0;  // less than 1: a frame has to get through some day
  double doubled = 0;
  Duration bus_off{};                          // from one bus-off to the next; 0 = never
  Duration restart = std::chrono::seconds(1);  // how long a bus-off lasts; 0 = until it is told to
  std::uint8_t stuck = 0;                      // node-ID, 0 = none
  Duration stuck_time{};                       // so long it works, so long it is stuck; 0 = always
  std::uint32_t seed = 1;

  bool of_bus() const { return lost > 0 || disturbed > 0 || doubled > 0 || stuck != 0; }
};

struct ParsedFaults {
  VirtualFaults faults;
  std::string error;  // empty, or a sentence for the integrator
};
ParsedFaults virtual_faults(const InterfaceUri& uri);

// While the bus runs: options as above, joined by "&", each in the place of what it was;
// `lost=off`, `stuck=off` and so on take one away, `off` takes all away, and `bus_off=now` is a
// bus-off at once.
struct FaultChange {
  VirtualFaults faults;
  bool bus_off_now = false;
  bool bus_off_ends = false;  // off, or bus_off=off: also the one there is
  std::string error;          // empty, or a sentence for whoever asked; then nothing changes
};
FaultChange change_faults(const VirtualFaults& faults, std::string_view text);

// As options of the interface would say it, in a fixed order; "off" if there are none.
std::string to_string(const VirtualFaults& faults);

}  // namespace linegate::can_bridge
