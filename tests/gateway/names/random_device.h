// SPDX-License-Identifier: Apache-2.0
// Devices with objects of random types in random PDOs.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "stack/od/data_type.h"

namespace linegate::names {

using Random = std::mt19937_64;

// A number from least to most.
std::uint64_t pick(Random& random, std::uint64_t least, std::uint64_t most);

struct RandomObject {
  std::uint16_t index = 0;
  std::string name;
  od::DataType type = od::DataType::none;
};

// An object in a PDO.
struct Mapped {
  RandomObject object;
  unsigned bits = 0;  // in the frame; of a BOOLEAN also 8, of which the lowest is the value
  unsigned offset = 0;

  unsigned value_bits() const { return object.type == od::DataType::boolean ? 1 : bits; }
  // writable: of a value that follows from its meaning: no half of a pair of surrogates, no bits
  // behind the end of a text, no reserved ones.
  std::uint64_t random_value(Random& random, bool writable) const;
};

struct RandomPdo {
  std::uint16_t number = 0;
  std::uint32_t identifier = 0;
  std::vector<Mapped> mapped;

  unsigned bits() const;
};

struct RandomDevice {
  std::vector<RandomPdo> inputs;   // TPDOs
  std::vector<RandomPdo> outputs;  // RPDOs

  // Its device file.
  std::string eds() const;
};

// identifier: the next one that no PDO has.
RandomDevice random_device(Random& random, std::uint32_t& identifier);

}  // namespace linegate::names
