// SPDX-License-Identifier: Apache-2.0
// The format of an input of the target `line`: three bytes for the setup, then steps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/line_subject.h"

namespace linegate::fuzz {

// The first byte of a step, modulo the number of steps.
enum class Step : std::uint8_t {
  frame,     // identifier (2, LE), length, data
  strange,   // identifier (4, LE), flags, length, data: extended, remote, FD
  burst,     // identifier (2, LE), count, one byte of data
  late,      // microseconds: age of the following frames, until `advance`
  advance,   //
  pass,      // milliseconds
  sleep,     // tenths of a second, and nobody looks
  send,      // frames
  lose,      // frames
  command,   // see read_form() in command_form.h
  write,     // see write() in line.cpp
  bus,       // kind, state or class, counter
  report,    // kind
  events,    // number of events
  replies,   //
  snapshot,  // direction, merge
  stop,      // only once
  message,   // from another line; see message() in line.cpp
  wait,      // tenths of a second
  cable,     // bit 0: the cable of the devices is plugged in
};
inline constexpr unsigned kSteps = 20;

// Size of the setup. Its first two bits are the role.
inline constexpr std::size_t kSetupBytes = 3;
using SetupBytes = std::array<std::uint8_t, kSetupBytes>;
enum SetupBit : std::uint8_t {
  kSync = 2,
  kHeartbeat,
  kGroups,
  kResetNodes,
  kAnswering,
  kGuarding,
  kTime,
  kLss,
  kUnknownNodes,
  kStrict,
  kKeepOperational,
  kStartAll,
  kStartsNobody,
  kMandatory,
  kOwnObjects,
  kStopAll,
  kResetAll,
  kBootTime,
  kUpdateTime,
  kProgram,
  kStore,
  kKeepAlive,
};

constexpr Setup setup(const SetupBytes& bytes) {
  const auto bit = [&bytes](unsigned number) {
    return (bytes[number / 8] >> number % 8 & 1U) != 0;
  };
  return {.role = static_cast<Role>(bytes[0] % 4U),
          .sync = bit(kSync),
          .heartbeat = bit(kHeartbeat),
          .groups = bit(kGroups),
          .reset_nodes = bit(kResetNodes),
          .answering = bit(kAnswering),
          .guarding = bit(kGuarding),
          .time = bit(kTime),
          .lss = bit(kLss),
          .unknown_nodes = bit(kUnknownNodes),
          .strict_ixxat = bit(kStrict),
          .keep_operational = bit(kKeepOperational),
          .start_all = bit(kStartAll),
          .starts_nobody = bit(kStartsNobody),
          .all_mandatory = bit(kMandatory),
          .own_objects = bit(kOwnObjects),
          .stop_all = bit(kStopAll),
          .reset_all = bit(kResetAll),
          .boot_time = bit(kBootTime),
          .update_time = bit(kUpdateTime),
          .program = bit(kProgram),
          .store = bit(kStore),
          .keep_alive = bit(kKeepAlive)};
}

}  // namespace linegate::fuzz
