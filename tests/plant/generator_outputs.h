// SPDX-License-Identifier: Apache-2.0
// Output actions of random plants. Private to the generator.
#pragma once

#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"

namespace linegate::plant {

// Writes transmission types and inhibit times of the RPDOs of that device, as words of its
// statement.
void give_pdos(std::ostream& out, std::mt19937_64& random, const Device& device, unsigned bit_rate);
// Writes values for most of its outputs, as words of a write; mostly the present values.
void give_values(std::ostream& out, std::mt19937_64& random, const Device& device);
// The objects that its RPDOs map, with their sizes in bytes.
std::vector<std::pair<std::string, unsigned>> outputs_of(const Device& device);
// Writes values for all of its outputs, with the lowest bytes of that number.
void give_numbered(std::ostream& out, const Device& device, unsigned number);

}  // namespace linegate::plant
