// SPDX-License-Identifier: Apache-2.0
// Commands to own devices in random plants, and times in which their line is off the bus or loses
// frames. Private to the generator.
#pragma once

#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"

namespace linegate::plant {

// Has its own random numbers: the rest of the plant is the same without it.
class OwnDeviceCommands {
 public:
  explicit OwnDeviceCommands(unsigned long seed)
      : random_(seed + 0x4F43), random_of_bus_(seed + 0x4F42) {}

  // Actions from that time on, each with its time in ms. ours: devices with the profile digital-io,
  // or empty.
  using Actions = std::vector<std::pair<unsigned, std::string>>;
  Actions draw(const std::vector<Device>& ours, unsigned time);
  // The device sends its TPDO with a value that is written now, and its master receives the value.
  void expect_value(std::ostream& out, const Device& device, unsigned time);

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  unsigned below_bus(unsigned limit) { return static_cast<unsigned>(random_of_bus_() % limit); }
  std::string command(const Device& device);
  void disturb(Actions& out, unsigned time);

  std::mt19937_64 random_;
  std::mt19937_64 random_of_bus_;
  unsigned number_ = 0;  // number of the command, part of its content
};

}  // namespace linegate::plant
