// SPDX-License-Identifier: Apache-2.0
// Opens the channel for an interface of the configuration.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "bridges/can/channel.h"
#include "bridges/can/controller_setup.h"
#include "bridges/sim/virtual_channel.h"
#include "gateway/config/plant.h"

namespace linegate::gateway {

// The use of the channel: an observer never transmits.
enum class Use : std::uint8_t { transmit, observe };

// The settings for the controller of a socketcan: interface, applied if it is found down and the
// interface has options: those of the options, and listen-only for an observer unless the options
// specify otherwise.
can_bridge::ControllerSetup controller_setup(const config::Interface& interface, Use use);

// Never fails: the channel reports an interface that cannot be opened, and retries. bit_rate: of a
// virtual bus, 0 = 1 Mbit/s, data_bit_rate: of the data phase of its FD frames, 0 = bit_rate; a
// kernel interface has its own.
std::unique_ptr<can_bridge::Channel> open_channel(const config::Interface& interface,
                                                  std::uint32_t bit_rate,
                                                  sim::VirtualNetwork& network,
                                                  Use use = Use::transmit,
                                                  std::uint32_t data_bit_rate = 0);

// The name for operators: the kernel's name, as used by ip, else the text of the configuration.
std::string name_for_people(const config::Interface& interface);

// The interface name in a candump log: the kernel's name, else the name of the line.
std::string name_in_log(const config::Interface& interface, const std::string& line);

}  // namespace linegate::gateway
