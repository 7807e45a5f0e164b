// SPDX-License-Identifier: Apache-2.0
// CommandKind::program: downloads a program to a node (CiA 302-3, 1F50h). One at a time for each
// node. Private to stack/line.
//
// The manager does not act on the node meanwhile: it may restart, fall silent, and identify itself
// as another device while its boot loader runs. Afterwards it is booted as after any reset, whether
// the download succeeded or not.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/manager/program_loader.h"

namespace linegate::line {

class ProgramService final : public Service {
 public:
  // own_node: the manager's node-ID, to which no program can be downloaded. All must outlive it.
  ProgramService(ServiceHost& host, manager::Manager& manager, manager::ProgramLoader& loader,
                 std::uint8_t own_node)
      : Service(host), manager_(manager), loader_(loader), own_node_(own_node) {}

  std::span<const CommandKind> commands() const override;
  // Answered without error when the program runs. Otherwise an SDO abort code, hardware (0606
  // 0000h) if the node reported an error, device_state (0800 0022h) if it restarted during the
  // download, and as data a ProgramFault. Refusals: wrong_role,
  // line_down, bad_request (no such node or program number, no data, or the own node), wrong_state
  // (the manager is not active), busy (a download to the node is under way), timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal why, Instant now) override;
  // Whether a command is under way.
  bool active() const { return !running_.empty(); }

 private:
  struct Running {
    std::uint64_t tag = 0;
    std::uint32_t client = 0;
    std::uint8_t node = 0;
    Instant deadline = kNever;
  };

  Refusal begin(Command& command, Instant now);
  void collect(Instant now);
  void expire(Instant now);

  manager::Manager& manager_;
  manager::ProgramLoader& loader_;
  const std::uint8_t own_node_;
  std::vector<Running> running_;
};

}  // namespace linegate::line
