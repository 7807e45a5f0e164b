// SPDX-License-Identifier: Apache-2.0
// A step of the boot slave process that is a process of its own: the check and download of the
// program (steps 7 and 8 of CiA 302-2), the configuration (steps 9 and 10).
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/manager/plan.h"
#include "stack/manager/state.h"
#include "stack/sdo/request.h"

namespace linegate::manager {

// The result of a step.
struct StepEnd {
  enum class Kind : std::uint8_t {
    done,    // the boot process continues with the next step
    failed,  // the boot process ends with the letter and the finding
    reset,   // the node is to be reset; resumed() follows its boot-up message
    unlike,  // it cannot be kept as it is: it is reset, and the boot process continues as with any
             // other node
    anew,    // the boot process starts again with the upload of 1000h: another program runs
  };
  Kind kind = Kind::done;
  char letter = kBooted;  // for Kind::failed
  BootFinding finding{};
  bool again = false;  // Kind::failed: the boot process tries again every second
};

// The services that a step may use while it runs.
class StepContext {
 public:
  virtual ~StepContext() = default;
  virtual const NodePlan& plan() const = 0;
  // For transfers without a longer time-out of their own.
  virtual Duration sdo_timeout() const = 0;
  // The node is kept alive: it is Operational, and nothing may be written to it.
  virtual bool is_kept_alive() const = 0;
  // Submits a transfer to the node's default server; owner, number, node and priority are filled
  // in. One at a time; BootStep::completed() reports its end.
  virtual void submit(sdo::Request request, Instant now) = 0;
};

// One object for each node; begin() precedes all other calls. All calls use the context of begin(),
// which stays valid until the end of the step or cancel().
class BootStep {
 public:
  virtual ~BootStep() = default;
  virtual void begin(StepContext& context, Instant now) = 0;
  // The submitted transfer has ended.
  virtual void completed(const sdo::Completion& completion, Instant now) = 0;
  // The node was reset, as requested with StepEnd::Kind::reset.
  virtual void resumed(Instant now) = 0;
  // Call it at next_wake().
  virtual void advance(Instant now) = 0;
  virtual Instant next_wake() const = 0;
  // The process ended without the result of this step; no further calls follow.
  virtual void cancel() = 0;
  // Returns the result once, when the step has ended. Called after each of the calls above.
  virtual std::optional<StepEnd> pop_end() = 0;
};

}  // namespace linegate::manager
