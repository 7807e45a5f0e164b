// SPDX-License-Identifier: Apache-2.0
// CommandKind::program: loads a program into a node (CiA 302-3, 1F50h). One at a time for each
// node. Private to stack/line.
//
// Meanwhile the manager leaves the node alone: it may restart, fall silent, and be another device
// as long as its boot loader runs. Afterwards it is booted as after any reset, well or not.
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
  // own_node: that of the manager, which loads no program into itself. All must outlive it.
  ProgramService(ServiceHost& host, manager::Manager& manager, manager::ProgramLoader& loader,
                 std::uint8_t own_node)
      : Service(host), manager_(manager), loader_(loader), own_node_(own_node) {}

  std::span<const CommandKind> commands() const override;
  // Answered without error when the program runs. Otherwise an SDO abort code, hardware
  // (0606 0000h) if the node reported an error, and as data what was wrong, see write_finding().
  // Refusals: wrong_role, line_down, bad_request (no node, no number of a program, no data, or the
  // own node), wrong_state (no manager at work), busy (the node is being loaded), timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal why, Instant now) override;
  // A command is under way.
  bool active() const { return !running_.empty(); }

 private:
  struct Running {
    std::uint64_t tag = 0;
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

// U16 index, U8 sub-index, U32 value that was found there (flash status, program control, software
// identification), little-endian.
std::vector<std::byte> write_finding(const manager::BootFinding& finding);

}  // namespace linegate::line
