// SPDX-License-Identifier: Apache-2.0
// Passes values from one line to another, across executors: outputs that follow inputs.
#pragma once

#include <span>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/wakeup.h"
#include "stack/line/following.h"
#include "stack/line/line.h"

namespace linegate::gateway {

class LineRunner;

// All bindings from one line to another. Their newest values are handed over together, so that
// values of one PDO stay together. Neither side waits for the other. On one executor the hand-over
// is a call; only a line that is not running finds the values here when it starts.
struct BoundLink {
  explicit BoundLink(std::vector<config::Binding> bindings_of_two_lines);

  const std::vector<config::Binding> bindings;
  const std::vector<line::Following> followings;  // those of the bindings, by parts
  exchange::Handover<std::vector<line::Line::Input>> values;
  // The receiver, set before either line runs: the target line's runner, which is called, if both
  // lines are on one executor; else the wake-up of the target's executor.
  LineRunner* runner = nullptr;
  exchange::Wakeup* taker = nullptr;
};

// The end of the inputs. Used by the thread that runs their line.
class BoundSource {
 public:
  explicit BoundSource(BoundLink& link);

  bool is_of(const BoundLink& link) const { return link_ == &link; }
  // Hands over the values that line::FollowedInputs reads. now: for the runner that is called.
  // Returns true if there were any. An executor that runs the receiver is woken, unless it is
  // called.
  bool look(const line::Line& line, Instant now);

 private:
  BoundLink* link_;
  line::FollowedInputs inputs_;
};

// The end of the outputs.
class BoundTarget {
 public:
  explicit BoundTarget(BoundLink& link);

  // Whether values were handed over that take() has not passed.
  bool has_values() const { return link_->values.fresh(); }
  // Passes the values that were handed over to line::FollowingOutputs. Returns true if anything was
  // written.
  bool take(line::Line& line, Instant now);
  // The same for these values. Precondition: take() was called since the link was last given any.
  bool write(line::Line& line, std::span<const line::Line::Input> values, Instant now) {
    return outputs_.take(line, values, now);
  }

  const BoundLink& link() const { return *link_; }

 private:
  BoundLink* link_;
  line::FollowingOutputs outputs_;
};

}  // namespace linegate::gateway
