// SPDX-License-Identifier: Apache-2.0
// Bit timing and restart policy of a CAN controller, set by netlink as `ip link set` does it.
#pragma once

#include <cstdint>
#include <optional>

namespace linegate::can_bridge {

// What is 0 or absent is left as it is.
struct ControllerSetup {
  std::uint32_t bit_rate = 0;       // bit/s
  std::uint32_t sample_point = 0;   // per mille of a bit
  std::uint32_t data_bit_rate = 0;  // bit/s, of the data phase: makes the interface a CAN FD one
  std::uint32_t data_sample_point = 0;  // per mille
  // From bus-off to the attempt to return to the bus, in ms; 0 = never, until somebody does it by
  // hand (ip link set can0 type can restart).
  std::optional<std::uint32_t> restart_ms;
  // Not even acknowledging what others send.
  std::optional<bool> listen_only;
  // Cannot be set: it stamps what it receives with a clock of its own.
  bool hardware_stamps = false;

  friend bool operator==(const ControllerSetup&, const ControllerSetup&) = default;

  bool any() const {
    return bit_rate != 0 || data_bit_rate != 0 || restart_ms.has_value() ||
           listen_only.value_or(false);
  }
};

// Bits of CAN_CTRLMODE_* (linux/can/netlink.h) that are to be set, in `mask`, and to what, in
// `flags`. CAN FD is never taken off.
struct ControllerModes {
  std::uint32_t mask = 0;
  std::uint32_t flags = 0;
};
ControllerModes modes_of(const ControllerSetup& setup);

// Sets it, and the interface up. The interface must be down. 0, or errno: EPERM without
// CAP_NET_ADMIN, EOPNOTSUPP or EINVAL for what the driver cannot do.
int set_up_controller(int interface_index, const ControllerSetup& setup);

// Takes the interface down and up, which every driver understands and which brings a controller
// back that is off the bus. (The kernel's own restart is not what every driver has, and Linux
// before 6.17 does not ask first.) 0, or errno: EPERM without CAP_NET_ADMIN.
int restart_controller(int interface_index);

}  // namespace linegate::can_bridge
