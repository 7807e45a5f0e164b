// SPDX-License-Identifier: Apache-2.0
// CommandKind::configure: compares what nodes have with their configuration, or applies it. One at
// a time; several nodes at once.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/manager/configurator.h"
#include "stack/manager/manager.h"

namespace linegate::line {

class ConfigureCommand {
 public:
  // All must outlive it.
  ConfigureCommand(manager::Manager& manager, manager::Configurator& configurator, EventLog& events)
      : manager_(manager), configurator_(configurator), events_(events) {}

  // none: it has begun, and ends with one Reply. Otherwise why not: bad_request (no such code, or
  // the node is not in the configuration), wrong_state (no manager at work), busy (another one is
  // under way).
  Refusal begin(const Command& command, Instant now);
  bool active() const { return running_.has_value(); }
  // Ends it with this reply. What is being applied goes on.
  void end(Refusal why);

  // Configures the nodes that 1F25h asked for.
  void carry_out_requests(Instant now);

  // Takes up what has been found and tells of it, at most once a second.
  void advance(Instant now);
  Instant next_wake() const;
  // Once when it has ended. The data: manager::write_configuration_report().
  std::optional<Reply> take_reply();

 private:
  struct Running {
    std::uint64_t tag = 0;
    bool apply = false;
    Instant deadline = kNever;
    Instant tell_at = kNever;         // of its progress
    std::bitset<128> nodes;           // that are not ready
    std::vector<std::size_t> totals;  // objects by node-ID
    std::vector<manager::NodeReport> reports;
  };

  void begin_node(std::uint8_t node, Instant now);
  void apply(std::uint8_t node, Instant now);
  void collect();
  manager::NodeReport applied(std::uint8_t node) const;
  void tell(Instant now) const;
  void finish();

  manager::Manager& manager_;
  manager::Configurator& configurator_;
  EventLog& events_;
  std::optional<Running> running_;
  std::optional<Reply> reply_;
};

}  // namespace linegate::line
