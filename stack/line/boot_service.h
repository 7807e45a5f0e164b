// SPDX-License-Identifier: Apache-2.0
// CommandKind::boot: repeats boot processes, and answers when all of them have ended (CiA 302-2).
// Private to stack/line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/line/service.h"
#include "stack/manager/manager.h"

namespace linegate::line {

class BootService final : public Service {
 public:
  static constexpr std::size_t kMost = 256;  // commands under way

  // own_node: the manager's node-ID, which has no boot process. The manager must outlive the
  // service.
  BootService(ServiceHost& host, manager::Manager& manager, std::uint8_t own_node)
      : Service(host), manager_(manager), own_node_(own_node) {}

  std::span<const CommandKind> commands() const override;
  // Answered with a manager::BootOutcome of each node. Refusals: bad_request (no such node, or the
  // own node), wrong_role, line_down, busy (kMost commands are under way), timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal why, Instant now) override;

 private:
  // A boot command under way.
  struct Boot {
    std::uint64_t tag = 0;
    std::vector<std::uint8_t> nodes;
    Instant deadline = kNever;
  };

  bool is_concluded(const Boot& boot) const;
  std::vector<manager::BootOutcome> report(const Boot& boot) const;

  manager::Manager& manager_;
  const std::uint8_t own_node_;
  std::vector<Boot> boots_;
};

}  // namespace linegate::line
