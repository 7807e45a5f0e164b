// SPDX-License-Identifier: Apache-2.0
// In random plants of CANopen FD: properties of the line, and foreign USDO clients and frames.
// Private to the generator.
#pragma once

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"

namespace linegate::plant {

// Has its own random numbers.
class ForeignClients {
 public:
  explicit ForeignClients(unsigned long seed) : random_(seed + 0x4644) {}

  std::mt19937_64& random() { return random_; }
  std::string line_words();
  // Actions from that time on, each with its time in ms.
  using Actions = std::vector<std::pair<unsigned, std::string>>;
  Actions draw(const std::vector<Device>& devices, unsigned time);

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  std::string access(const Device& device);
  std::string unfinished(const Device& device);
  std::string garbage(const Device& device);
  std::string any_frame();

  std::mt19937_64 random_;
};

}  // namespace linegate::plant
