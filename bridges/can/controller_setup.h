// SPDX-License-Identifier: Apache-2.0
// Bit timing and restart policy of a CAN controller, set by netlink as `ip link set` does it.
#pragma once

#include <cstdint>
#include <optional>

namespace linegate::can_bridge {

// Members that are 0 or absent are left unchanged.
struct ControllerSetup {
  std::uint32_t bit_rate = 0;           // bit/s
  std::uint32_t sample_point = 0;       // per mille of a bit
  std::uint32_t data_bit_rate = 0;      // bit/s in the data phase; non-zero selects CAN FD
  std::uint32_t data_sample_point = 0;  // per mille
  // Time from bus-off to the automatic restart, in ms; 0: restart only by hand (ip link set can0
  // type can restart).
  std::optional<std::uint32_t> restart_ms;
  // Do not even acknowledge the frames of other nodes.
  std::optional<bool> listen_only;
  // Read only: the controller stamps received frames with its own clock.
  bool hardware_stamps = false;

  friend bool operator==(const ControllerSetup&, const ControllerSetup&) = default;

  bool any() const {
    return bit_rate != 0 || data_bit_rate != 0 || restart_ms.has_value() ||
           listen_only.value_or(false);
  }
};

// Bits of CAN_CTRLMODE_* (linux/can/netlink.h): `mask` selects the bits to change, `flags` has
// their new values. CAN FD is never switched off.
struct ControllerModes {
  std::uint32_t mask = 0;
  std::uint32_t flags = 0;
};
ControllerModes modes_of(const ControllerSetup& setup);

// Configures the controller and sets the interface up. Precondition: the interface is down. Returns
// 0 or errno: EPERM without CAP_NET_ADMIN, EOPNOTSUPP or EINVAL for what the driver cannot do.
int set_up_controller(int interface_index, const ControllerSetup& setup);

// Sets the interface down and up, which restarts a controller that is bus-off with every driver.
// (Not every driver supports the kernel's own restart, and Linux before 6.17 does not check.)
// Returns 0 or errno: EPERM without CAP_NET_ADMIN.
int restart_controller(int interface_index);

}  // namespace linegate::can_bridge
