// SPDX-License-Identifier: Apache-2.0
// What random plants do with outputs. Private to the generator.
#pragma once

#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"

namespace linegate::plant {

// Transmission types and inhibit times of the RPDOs of that device, as words of its statement.
void give_pdos(std::ostream& out, std::mt19937_64& random, const Device& device, unsigned bit_rate);
// Values for most of its outputs, as words of a write; mostly those that they have.
void give_values(std::ostream& out, std::mt19937_64& random, const Device& device);
// The objects that its RPDOs map, and their bytes.
std::vector<std::pair<std::string, unsigned>> outputs_of(const Device& device);
// Values for all of its outputs, all with the lowest bytes of that number.
void give_numbered(std::ostream& out, const Device& device, unsigned number);

}  // namespace linegate::plant
