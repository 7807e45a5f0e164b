// SPDX-License-Identifier: Apache-2.0
// The NMT state machine of a device (CiA 301, 7.3.2.2): which state follows which command.
//
//   Initialising --boot-up--> Pre-operational <--> Operational, Stopped
// It only knows states. What a reset restores and which services stop is done by node::Node.
#pragma once

#include <cstdint>

#include "stack/nmt/state.h"

namespace linegate::nmt {

// What the owner has to do after a command.
enum class Effect : std::uint8_t {
  none,                 // the state is as it was
  state_changed,        // to the new state()
  reset_node,           // restore everything, then call booted(); state() is initialising
  reset_communication,  // restore the communication area, then call booted()
};

class Slave {
 public:
  State state() const { return state_; }

  // Obeyed in every state but Initialising.
  Effect command(Command command);

  // Initialisation is complete and the boot-up message has been sent: Pre-operational.
  void booted();
  // Back to Initialising without a command: power-on.
  void initialise();

 private:
  Effect enter(State state);

  State state_ = State::initialising;
};

}  // namespace linegate::nmt
