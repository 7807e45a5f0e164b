// SPDX-License-Identifier: Apache-2.0
// Programs of the nodes of a line (CiA 302-2, 1F50h to 1F58h): checks them as a step of the boot
// slave processes, and updates a different software if permitted; and loads a program on command.
// Several nodes at once.
//
// The progress of a download is reported each second as event::CommandProgress, in bytes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/manager/boot_step.h"
#include "stack/manager/node_tasks.h"
#include "stack/manager/program_objects.h"
#include "stack/manager/program_run.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

class ProgramLoader {
 public:
  // command: event::CommandProgress::command. All references must outlive this object. See
  // ProgramObjects for the dictionary and the plans. sdo_timeout: for most answers of a node.
  ProgramLoader(od::Dictionary& dictionary, std::span<const NodePlan> plans, sdo::Arbiter& sdo,
                EventLog& events, Duration sdo_timeout, line::CommandKind command);

  // The program step of the node's boot slave process; this object must outlive it. Ends with G, H
  // or I.
  std::unique_ptr<BootStep> make_step(std::uint8_t node);

  // Loads a program on command, whatever software the node runs. Precondition:
  // !loading(order.node), and no boot process of the node is in progress. client: see
  // sdo::Request::client.
  void load(ProgramOrder order, Instant now, std::uint32_t client = 0);
  bool loading(std::uint8_t node) const { return tasks_.busy(node); }
  // The node sent its boot-up message.
  void boot_up(std::uint8_t node);
  void cancel(std::uint8_t node) { (void)tasks_.cancel(node); }
  // Removes and returns the run that ended first; nullptr if there is none.
  std::unique_ptr<ProgramRun> pop_ended() { return tasks_.pop_ended(); }

  void advance(Instant now);
  Instant next_wake() const { return earlier(tasks_.next_wake(), report_at_); }

 private:
  class Step;

  ProgramOrder order(std::uint8_t node) const;
  void runs(std::uint8_t node, ProgramRun* run, Instant now);
  ProgramRun* running(std::uint8_t node) const;

  const od::Dictionary& dictionary_;
  EventLog& events_;
  line::CommandKind command_;
  ProgramObjects objects_;
  NodeTasks<ProgramRun> tasks_;
  std::array<ProgramRun*, 128> steps_{};  // of boot processes, by node-ID
  Instant report_at_ = kNever;
};

}  // namespace linegate::manager
