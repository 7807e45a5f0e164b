// SPDX-License-Identifier: Apache-2.0
// CommandKind::program: loads a program into a node. One at a time for each node.
//
// Meanwhile the manager leaves the node alone: it may restart, fall silent, and be another device
// as long as its boot loader runs. Afterwards it is booted as after any reset, well or not.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/manager/manager.h"
#include "stack/manager/program_loader.h"

namespace linegate::line {

class ProgramCommand {
 public:
  // Both must outlive it.
  ProgramCommand(manager::Manager& manager, manager::ProgramLoader& loader)
      : manager_(manager), loader_(loader) {}

  // none: it has begun, and ends with one Reply. Otherwise why not: bad_request (no node, no number
  // of a program, no data), wrong_state (no manager at work), busy (the node is being loaded).
  Refusal begin(Command command, Instant now);
  bool active() const { return !running_.empty(); }
  // Ends all with this reply.
  void end(Refusal why, Instant now);

  // Takes up what has ended.
  void advance(Instant now);
  Instant next_wake() const;
  // The oldest not yet taken. ok: the program runs. Otherwise an SDO abort code, hardware (0606
  // 0000h) if the node told an error, and the data: what was found wrong, see write_finding().
  std::optional<Reply> take_reply();

 private:
  struct Running {
    std::uint64_t tag = 0;
    std::uint8_t node = 0;
    Instant deadline = kNever;
  };

  void collect(Instant now);
  void expire(Instant now);

  manager::Manager& manager_;
  manager::ProgramLoader& loader_;
  std::vector<Running> running_;
  std::deque<Reply> replies_;
};

// U16 index, U8 sub-index, U32 value that was found there (flash status, program control, software
// identification), little-endian.
std::vector<std::byte> write_finding(const manager::BootFinding& finding);

}  // namespace linegate::line
