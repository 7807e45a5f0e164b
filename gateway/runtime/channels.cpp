// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/channels.h"

#include "bridges/can/replay.h"
#include "bridges/can/socketcan.h"
#include "bridges/can/udp.h"
#include "bridges/can/virtual_faults.h"

namespace linegate::gateway {

can_bridge::ControllerSetup controller_setup(const config::Interface& interface, Use use) {
  can_bridge::ControllerSetup setup =
      can_bridge::controller_setup({"socketcan", interface.name, interface.options}).setup;
  if (use == Use::observe && setup.any() && !setup.listen_only) {
    setup.listen_only = true;
  }
  return setup;
}

std::unique_ptr<can_bridge::Channel> open_channel(const config::Interface& interface,
                                                  std::uint32_t bit_rate,
                                                  sim::VirtualNetwork& network, Use use,
                                                  std::uint32_t data_bit_rate) {
  if (interface.scheme == config::Scheme::socketcan) {
    can_bridge::SocketOptions options;
    options.setup = controller_setup(interface, use);
    return can_bridge::open_socketcan(interface.name, options);
  }
  if (interface.scheme == config::Scheme::replay) {
    return can_bridge::open_replay(
        interface.name,
        can_bridge::replay_options({"replay", interface.name, interface.options}).options);
  }
  if (interface.scheme == config::Scheme::udp) {
    return can_bridge::open_udp(
        can_bridge::udp_options({"udp", interface.name, interface.options}).options);
  }
  sim::BusOptions options;
  if (bit_rate != 0) {
    options.bit_rate = bit_rate;
  }
  options.data_bit_rate = data_bit_rate;
  // The bus of a simulated: line gets a name that no virtual: interface can have, so no other line
  // joins it.
  const bool own = interface.scheme == config::Scheme::simulated;
  const auto faults = can_bridge::virtual_faults({"virtual", interface.name, interface.options});
  return network.open(own ? "simulated:" + interface.name : interface.name, options, faults.faults);
}

std::string name_for_people(const config::Interface& interface) {
  return interface.scheme == config::Scheme::socketcan ? interface.name : interface.uri;
}

std::string name_in_log(const config::Interface& interface, const std::string& line) {
  return interface.scheme == config::Scheme::socketcan ? interface.name : line;
}

}  // namespace linegate::gateway
