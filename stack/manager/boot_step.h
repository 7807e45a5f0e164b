// SPDX-License-Identifier: Apache-2.0
// A step of the boot slave process that is a process of its own: the check and download of the
// program (steps 7 and 8), the configuration (steps 9 and 10).
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/manager/plan.h"
#include "stack/manager/state.h"
#include "stack/sdo/request.h"

namespace linegate::manager {

// How a step ended.
struct StepEnd {
  enum class Kind : std::uint8_t {
    done,    // the boot process goes on with the next step
    failed,  // it ends, with the letter and what was found
    reset,   // the node is to be reset; resumed() follows its boot-up message
    anew,    // the boot process begins again with reading 1000h: another program runs
  };
  Kind kind = Kind::done;
  char letter = kBooted;  // of failed
  BootFinding finding{};
};

// What a step may use while it runs.
class StepContext {
 public:
  virtual ~StepContext() = default;
  virtual const NodePlan& plan() const = 0;
  // Of a transfer that needs no longer than others of this node.
  virtual Duration sdo_timeout() const = 0;
  // Hands a transfer to the node's default server; owner, number, node and priority are set
  // here. One at a time; its end comes as BootStep::completed().
  virtual void submit(sdo::Request request, Instant now) = 0;
};

// One object for each node; begin() comes before all others. All are called with the context of
// begin(), which stays valid until the end or cancel().
class BootStep {
 public:
  virtual ~BootStep() = default;
  virtual void begin(StepContext& context, Instant now) = 0;
  // The end of the transfer that was submitted.
  virtual void completed(const sdo::Completion& completion, Instant now) = 0;
  // The node has been reset, as StepEnd::Kind::reset asked for.
  virtual void resumed(Instant now) = 0;
  // Due at next_wake().
  virtual void advance(Instant now) = 0;
  virtual Instant next_wake() const = 0;
  // The process ended without it: nothing more will come.
  virtual void cancel() = 0;
  // Once, when it has ended. Asked after each of the calls above.
  virtual std::optional<StepEnd> take_end() = 0;
};

}  // namespace linegate::manager
