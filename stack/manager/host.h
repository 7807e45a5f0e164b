// SPDX-License-Identifier: Apache-2.0
// What the manager and its boot processes ask of the line they belong to.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/nmt/state.h"

namespace linegate::manager {

class Host {
 public:
  virtual ~Host() = default;
  // The process data of the node can no longer be trusted: lost, reset or starting anew.
  virtual void node_data_invalid(std::uint8_t node) = 0;
  // Every mandatory node is booted: the own node may become Operational.
  virtual void may_operate(Instant now) = 0;
  // Sends an NMT command to one node, or to all with 0. Not the own node.
  virtual void send_nmt(nmt::Command command, std::uint8_t node, Instant now) = 0;
  // Whether Manager::start_acknowledged() follows an NMT command start when the bus has it.
  virtual bool acknowledges_starts() const = 0;
  // The same for the own node. Its dictionary may have other values afterwards.
  virtual void command_own(nmt::Command command, Instant now) = 0;
  virtual nmt::State own_state() const = 0;
};

}  // namespace linegate::manager
