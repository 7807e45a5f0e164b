// SPDX-License-Identifier: Apache-2.0
// In random plants: commands of unconfirmed services, and times in which the bus acknowledges
// nothing. Private to the generator.
#pragma once

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"

namespace linegate::plant {

// Has its own random numbers: the rest of the plant is the same without it.
class ServiceCommands {
 public:
  explicit ServiceCommands(unsigned long seed) : random_(seed + 0x5343) {}

  // No MPDOs: they are not defined for CANopen FD.
  void be_fd() { fd_ = true; }
  // A property of the line.
  std::string line_words();
  // Actions from that time on, each with its time in ms.
  using Actions = std::vector<std::pair<unsigned, std::string>>;
  Actions draw(const std::vector<Device>& devices, unsigned time);

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  const Device& one_of(const std::vector<Device>& devices) {
    return devices[below(static_cast<unsigned>(devices.size()))];
  }
  std::string command(const std::vector<Device>& devices);
  std::string output(const Device& device);
  std::string pdo_write(const Device& device) const;
  unsigned silence(Actions& out, unsigned time);
  std::string hex_of(unsigned bytes) const;

  std::mt19937_64 random_;
  bool fd_ = false;
  bool has_mpdo_ = false;
  unsigned number_ = 0;  // number of the command: its name, and a part of its content
};

}  // namespace linegate::plant
