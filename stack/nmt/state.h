// SPDX-License-Identifier: Apache-2.0
// NMT states and commands (CiA 301, 7.2.8.2 and 7.3.2), and the states of a flying master.
#pragma once

#include <cstdint>
#include <string_view>

namespace linegate::nmt {

// The state codes in heartbeats and node guarding answers.
enum class State : std::uint8_t {
  initialising = 0x00,
  stopped = 0x04,
  operational = 0x05,
  pre_operational = 0x7F,
  unknown = 0xFF,  // never on the wire: no message received yet
};

// Command specifiers of the node control service.
enum class Command : std::uint8_t {
  start = 0x01,
  stop = 0x02,
  enter_pre_operational = 0x80,
  reset_node = 0x81,
  reset_communication = 0x82,
};

// Of a flying master (CiA 302-2), see flying_master.h. The numbers are part of the DDS contract.
enum class FlyingMasterState : std::uint8_t {
  none,       // it is no flying master
  detect,     // it searches for an active NMT master
  reset,      // it found none, has reset the communication of all nodes, and searches again
  negotiate,  // it waits for its turn, by priority and node-ID
  master,     // it is the active NMT master
  slave,      // another node is the active NMT master
  force,      // it has forced a new negotiation, and searches again
};

constexpr bool is_command(std::uint8_t cs) {
  return cs == 0x01 || cs == 0x02 || (cs >= 0x80 && cs <= 0x82);
}

constexpr bool is_reset(Command command) {
  return command == Command::reset_node || command == Command::reset_communication;
}

constexpr std::string_view name(State state) {
  switch (state) {
    case State::initialising:
      return "initialising";
    case State::stopped:
      return "stopped";
    case State::operational:
      return "operational";
    case State::pre_operational:
      return "pre-operational";
    case State::unknown:
      break;
  }
  return "unknown";
}

constexpr std::string_view name(FlyingMasterState state) {
  switch (state) {
    case FlyingMasterState::none:
      return "none";
    case FlyingMasterState::detect:
      return "detect";
    case FlyingMasterState::reset:
      return "reset";
    case FlyingMasterState::negotiate:
      return "negotiate";
    case FlyingMasterState::master:
      return "master";
    case FlyingMasterState::slave:
      return "slave";
    case FlyingMasterState::force:
      return "force";
  }
  return "unknown";
}

constexpr std::string_view name(Command command) {
  switch (command) {
    case Command::start:
      return "start";
    case Command::stop:
      return "stop";
    case Command::enter_pre_operational:
      return "enter-pre-operational";
    case Command::reset_node:
      return "reset-node";
    case Command::reset_communication:
      return "reset-communication";
  }
  return "unknown";
}

}  // namespace linegate::nmt
