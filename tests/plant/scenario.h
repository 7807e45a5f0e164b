// SPDX-License-Identifier: Apache-2.0
// Scenarios as text that a CANopen engineer can read and write; README.md describes the language.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace linegate::plant {

// The result of a scenario. failure is empty if every expectation and every oracle held; else it
// begins with "name:line: ".
struct Outcome {
  std::string failure;
  std::string history;        // the last events of every line, in case of a failure
  unsigned long frames = 0;   // number of frames on all buses
  unsigned long steps = 0;    // number of steps of the world; its models were compared after each
  unsigned expectations = 0;  // number of checked expectations
  // Numbers of comparisons since the last start of each line: of valid outputs with their device,
  // of valid outputs of the own node with their frame, and of single writes to these
  std::uint64_t outputs = 0;
  std::uint64_t own_outputs = 0;
  std::uint64_t own_writes = 0;

  bool ok() const { return failure.empty(); }
};

// Runs the scenario from start to end in virtual time. seed determines the values of the devices
// and the losses. Oracles (see oracles.h) run after every statement and at the end.
Outcome run_scenario(std::string_view name, std::string_view text, unsigned long seed);

}  // namespace linegate::plant
