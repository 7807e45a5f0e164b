// SPDX-License-Identifier: Apache-2.0
// In random plants: TPDOs that are only sent on request, and output values that change faster than
// they are transmitted. Private to the generator.
#pragma once

#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"

namespace linegate::plant {

// Has its own random numbers: the rest of the plant is the same without it.
class RequestsAndBursts {
 public:
  explicit RequestsAndBursts(unsigned long seed) : random_(seed + 0x5252) {}

  // No TPDO is on request: CANopen FD has none.
  void be_fd() { fd_ = true; }
  // A property of the device: its first TPDO has type 252 or 253. Empty for most devices.
  std::string device_words(const Device& device);
  // Actions from that time on, each with its time in ms.
  using Actions = std::vector<std::pair<unsigned, std::string>>;
  Actions draw(const std::vector<Device>& devices, unsigned time);
  // At that time the network is not disturbed, and the own node is Operational: requests are
  // answered.
  void expect_answers(std::ostream& out, const std::vector<Device>& devices, unsigned time);
  bool sends_on_request(const Device& device) const { return find(device) != nullptr; }
  // A remote frame of a foreign station, if the device has such a TPDO.
  void request_by_stranger(std::ostream& out, const Device& device, unsigned time);

 private:
  struct Tpdo {
    unsigned node = 0;
    unsigned number = 0;
    unsigned cob_id = 0;
  };

  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  const Tpdo* find(const Device& device) const;
  std::string stranger(const Tpdo& tpdo);
  void burst(Actions& out, const Device& device, unsigned time);

  std::mt19937_64 random_;
  bool fd_ = false;
  std::vector<Tpdo> tpdos_;
  unsigned number_ = 0;  // number of a request, its name
  unsigned value_ = 0;   // the last output value; each value is different
};

}  // namespace linegate::plant
