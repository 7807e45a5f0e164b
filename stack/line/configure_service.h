// SPDX-License-Identifier: Apache-2.0
// CommandKind::configure: compares nodes with their configuration, or applies it (CiA 302-3). One
// command at a time, which may process several nodes at once. Private to stack/line.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/line/service.h"
#include "stack/manager/configurator.h"
#include "stack/manager/manager.h"

namespace linegate::line {

class ConfigureService final : public Service {
 public:
  // All must outlive it.
  ConfigureService(ServiceHost& host, manager::Manager& manager,
                   manager::Configurator& configurator, EventLog& events);

  std::span<const CommandKind> commands() const override;
  // Answered with a manager::NodeReport of each node. Refusals: wrong_role, line_down,
  // bad_request (the node is not configured), wrong_state (the manager is not active), busy
  // (another command is under way), timed_out.
  void execute(Command command, Instant now) override;
  // Emits event::CommandProgress at most once a second. Also executes requests by 1F25h.
  void advance(Instant now) override;
  Instant next_wake() const override;
  // Configurations that are being applied continue.
  void end(Refusal why, Instant now) override;
  // Whether a command is under way.
  bool active() const { return running_.has_value(); }

  // Configures the nodes that were requested with 1F25h. client: as Command::client.
  void carry_out_requests(Instant now, std::uint32_t client = 0);

 private:
  struct Running {
    std::uint64_t tag = 0;
    std::uint32_t client = 0;
    bool apply = false;
    Instant deadline = kNever;
    Instant report_at = kNever;       // next progress report
    std::bitset<128> nodes;           // nodes that are not finished
    std::vector<std::size_t> totals;  // objects by node-ID
    std::vector<manager::NodeReport> reports;
  };

  Refusal begin(const Command& command, Instant now);
  AbortCode may_configure(std::uint8_t id) const;
  void begin_node(std::uint8_t node, Instant now);
  void apply(std::uint8_t node, Instant now, std::uint32_t client = 0);
  void conclude(Instant now);
  void collect();
  manager::NodeReport applied(std::uint8_t node) const;
  void report_progress(Instant now) const;
  void finish();

  manager::Manager& manager_;
  manager::Configurator& configurator_;
  EventLog& events_;
  std::optional<Running> running_;
};

}  // namespace linegate::line
