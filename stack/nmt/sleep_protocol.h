// SPDX-License-Identifier: Apache-2.0
// The messages and phases of sleep as plain values, see sleep.h.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/base/time.h"

namespace linegate::nmt {

// Append only: part of the DDS contract.
enum class SleepPhase : std::uint8_t { awake, check, prepare, silent, asleep };

// Why a phase began. Append only: part of the DDS contract.
enum class SleepCause : std::uint8_t {
  command,         // of a client, or of the application
  master,          // a message of the NMT master
  time,            // the time of the phase before is over
  objection,       // of the node in SleepChange::node
  wake,            // the message wake of a node
  frame,           // a frame was received while asleep
  no_acknowledge,  // the bus did not acknowledge the master's message in the time of the phase
  role,            // the node became NMT master or slave during the check
};

constexpr std::string_view name(SleepPhase phase) {
  constexpr std::array<std::string_view, 5> kNames{"awake", "check", "prepare", "silent", "asleep"};
  const auto i = static_cast<std::size_t>(phase);
  return i < kNames.size() ? kNames[i] : "unknown";
}
constexpr std::string_view name(SleepCause cause) {
  constexpr std::array<std::string_view, 8> kNames{
      "command", "master", "time", "objection", "wake message", "frame", "no acknowledge", "role"};
  const auto i = static_cast<std::size_t>(cause);
  return i < kNames.size() ? kNames[i] : "unknown";
}

struct SleepProtocol {
  std::uint32_t request = 0;  // 11-bit identifiers; 0 = the line does not sleep
  std::uint32_t objection = 0;
  std::uint8_t check_byte = 1;  // of requests
  std::uint8_t prepare_byte = 2;
  std::uint8_t wake_byte = 3;
  std::uint8_t objection_byte = 4;
  Duration check_time = std::chrono::seconds(1);
  Duration prepare_time = std::chrono::seconds(1);  // timer 1
  Duration silent_time = std::chrono::seconds(1);   // timer 2

  bool exists() const { return request != 0; }

  friend bool operator==(const SleepProtocol&, const SleepProtocol&) = default;
};

}  // namespace linegate::nmt
