// SPDX-License-Identifier: Apache-2.0
// From an interface of the configuration to a channel.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "bridges/can/channel.h"
#include "bridges/can/controller_setup.h"
#include "bridges/sim/virtual_channel.h"
#include "gateway/config/plant.h"

namespace linegate::gateway {

// What the channel is for: an observer never transmits.
enum class Use : std::uint8_t { transmit, observe };

// How the controller of a socketcan: interface is set up, if it is (when it is found down and the
// interface has options): as the options say, and for an observer listen-only where they do not
// say anything else.
can_bridge::ControllerSetup controller_setup(const config::Interface& interface, Use use);

// Never fails: an interface that cannot be opened is reported by the channel and tried again.
// bit_rate: of a virtual bus, 0 = 1 Mbit/s; a kernel interface has its own.
std::unique_ptr<can_bridge::Channel> open_channel(const config::Interface& interface,
                                                  std::uint32_t bit_rate,
                                                  sim::VirtualNetwork& network,
                                                  Use use = Use::transmit);

// What an operator calls it: the kernel's name, as ip wants it, else what the configuration says.
std::string name_for_people(const config::Interface& interface);

// What a candump log calls the interface: the kernel's name, else that of the line.
std::string name_in_log(const config::Interface& interface, const std::string& line);

}  // namespace linegate::gateway
