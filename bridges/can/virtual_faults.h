// SPDX-License-Identifier: Apache-2.0
// Simulated faults: the options of "virtual:NAME".
//
//   virtual:press?lost=1%                   1% of all frames on the bus reach no receiver
//   virtual:press?disturbed=0.5%&seed=7     0.5% are destroyed by an error frame, and sent again
//   virtual:press?doubled=0.1%              0.1% arrive twice
//   virtual:press?stuck=5@10s               node 5 is alternately working and stuck, for 10 s each
//   virtual:press?stuck=5@always            node 5 is stuck
//   virtual:press?bus_off=10s               this end goes bus-off every 10 s, for a second
//   virtual:press?bus_off=10s&restart=never and stays bus-off until its controller is restarted
//
// All but the last two apply to the whole bus, whichever of its ends has the option. The same seed
// and the same frames result in the same faults. While a node is stuck, no receiver gets the frames
// that it sends with identifiers of the pre-defined connection set: EMCY, TPDO 1 to 4, SDO,
// heartbeat.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "bridges/can/interface_uri.h"
#include "stack/base/time.h"

namespace linegate::can_bridge {

struct VirtualFaults {
  double lost = 0;       // probability, 0 to 1; the sum of lost and disturbed is at most 1
  double disturbed = 0;  // probability, less than 1, so that each frame is sent eventually
  double doubled = 0;
  Duration bus_off{};  // interval between two bus-offs; 0 = never
  // Duration of a bus-off; 0 = until the controller is restarted
  Duration restart = std::chrono::seconds(1);
  std::uint8_t stuck = 0;  // node-ID, 0 = none
  // The node alternates between working and stuck for this long; 0 = always stuck
  Duration stuck_time{};
  std::uint32_t seed = 1;

  bool of_bus() const { return lost > 0 || disturbed > 0 || doubled > 0 || stuck != 0; }
};

struct ParsedFaults {
  VirtualFaults faults;
  std::string error;  // empty, or an error message
};
ParsedFaults virtual_faults(const InterfaceUri& uri);

// A change of faults at run time: options as above, joined by "&", each replacing its present
// value. `lost=off`, `stuck=off` and so on remove one; `off` removes all; `bus_off=now` causes a
// bus-off at once.
struct FaultChange {
  VirtualFaults faults;
  bool bus_off_now = false;
  bool bus_off_ends = false;  // off or bus_off=off: also ends a bus-off that lasts
  std::string error;          // empty, or an error message; then nothing changes
};
FaultChange change_faults(const VirtualFaults& faults, std::string_view text);

// In the syntax of the interface's options, in a fixed order; "off" if there are none.
std::string to_string(const VirtualFaults& faults);

}  // namespace linegate::can_bridge
