// SPDX-License-Identifier: Apache-2.0
// The services that the manager and its boot processes need from their line.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/nmt/state.h"

namespace linegate::manager {

class Host {
 public:
  virtual ~Host() = default;
  // The process data of the node are no longer valid: it was lost or reset, or is starting again.
  virtual void node_data_invalid(std::uint8_t node) = 0;
  // Every mandatory node is booted: the own node may become Operational.
  virtual void mandatory_nodes_booted(Instant now) = 0;
  // Sends an NMT command to one node, or to all with 0. Not the own node.
  virtual void send_nmt(nmt::Command command, std::uint8_t node, Instant now) = 0;
  // Whether the line calls Manager::start_acknowledged() once the bus has acknowledged an NMT
  // command start.
  virtual bool acknowledges_starts() const = 0;
  // The same for the own node. Values of its dictionary may change.
  virtual void command_own(nmt::Command command, Instant now) = 0;
  virtual nmt::State own_state() const = 0;
};

}  // namespace linegate::manager
