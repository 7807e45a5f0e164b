// SPDX-License-Identifier: Apache-2.0
// The NMT state machine of a device (CiA 301, 7.3.2.2).
//
//   Initialising --boot-up--> Pre-operational <--> Operational, Stopped
// This class only tracks the state: node::Node restores values after a reset and starts and stops
// services.
#pragma once

#include <cstdint>

#include "stack/nmt/state.h"

namespace linegate::nmt {

// The action that the owner has to take after a command.
enum class Effect : std::uint8_t {
  none,                 // the state is unchanged
  state_changed,        // the state changed to state()
  reset_node,           // restore all values, then call booted(); state() is initialising
  reset_communication,  // restore the communication area, then call booted()
};

class Slave {
 public:
  State state() const { return state_; }

  // Commands are executed in every state except Initialising.
  Effect command(Command command);

  // Initialisation is complete and the boot-up message was sent: enters Pre-operational.
  void booted();
  // Returns to Initialising without a command: power-on.
  void initialise();

 private:
  Effect enter(State state);

  State state_ = State::initialising;
};

}  // namespace linegate::nmt
