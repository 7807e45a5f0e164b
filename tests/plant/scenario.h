// SPDX-License-Identifier: Apache-2.0
// Scenarios as text a CANopen person can read and write; README.md has the language.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace linegate::plant {

// How a scenario went. failure is empty if every expectation and every oracle held; else it begins
// with "name:line: ".
struct Outcome {
  std::string failure;
  std::string history;        // the last events of every line, if it failed
  unsigned long frames = 0;   // on all buses
  unsigned long steps = 0;    // of the world, after each of which its models were compared
  unsigned expectations = 0;  // checked

  bool ok() const { return failure.empty(); }
};

// Runs it from start to end in virtual time. seed moves the values of devices and the chances of
// losses. Oracles (see oracles.h) run after every statement and at the end.
Outcome run_scenario(std::string_view name, std::string_view text, unsigned long seed);

}  // namespace linegate::plant
