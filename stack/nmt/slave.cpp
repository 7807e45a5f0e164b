// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/slave.h"

#include "stack/base/assert.h"

namespace linegate::nmt {

Effect Slave::command(Command command) {
  if (state_ == State::initialising) {
    return Effect::none;
  }
  switch (command) {
    case Command::start:
      return enter(State::operational);
    case Command::stop:
      return enter(State::stopped);
    case Command::enter_pre_operational:
      return enter(State::pre_operational);
    case Command::reset_node:
      state_ = State::initialising;
      return Effect::reset_node;
    case Command::reset_communication:
      state_ = State::initialising;
      return Effect::reset_communication;
  }
  return Effect::none;
}

void Slave::booted() {
  LINEGATE_ASSERT(state_ == State::initialising, "a node boots once after each reset");
  state_ = State::pre_operational;
}

void Slave::initialise() {
  state_ = State::initialising;
}

Effect Slave::enter(State state) {
  if (state_ == state) {
    return Effect::none;
  }
  state_ = state;
  return Effect::state_changed;
}

}  // namespace linegate::nmt
