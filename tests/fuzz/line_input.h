// The form of an input of the target `line`: one byte for the setup, then steps.
#pragma once

#include <cstdint>

#include "tests/fuzz/line_subject.h"

namespace linegate::fuzz {

// First byte of a step, modulo their number.
enum class Step : std::uint8_t {
  frame,     // identifier (2, LE), length, data
  strange,   // identifier (4, LE), flags, length, data: extended, remote, FD
  burst,     // identifier (2, LE), count, one byte of data
  late,      // microseconds: that old are the frames that follow until `advance`
  advance,   //
  pass,      // milliseconds
  sleep,     // tenths of a second
  send,      // frames
  lose,      // frames
  command,   // see command() in line.cpp
  write,     // see write() in line.cpp
  bus,       // kind, state or class, counter
  report,    // kind
  events,    // how many
  replies,   //
  snapshot,  // direction, merge
  stop,      // only once
  message,   // from another line; see message() in line.cpp
};
inline constexpr unsigned kSteps = 18;

// The setup's byte.
constexpr Setup setup(std::uint8_t bits) {
  const auto bit = [bits](unsigned number) { return (bits >> number & 1U) != 0; };
  return {.device_role = bit(0),
          .sync = bit(1),
          .heartbeat = bit(2),
          .groups = bit(3),
          .reset_nodes = bit(4),
          .answering = bit(5),
          .guarding = bit(6),
          .time = bit(7)};
}

}  // namespace linegate::fuzz
