// SPDX-License-Identifier: Apache-2.0
// Values that one line passes on to another, across executors: outputs that follow inputs.
#pragma once

#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/wakeup.h"
#include "stack/line/following.h"
#include "stack/line/line.h"

namespace linegate::gateway {

class LineRunner;

// All bindings from one line to another. The newest values of all of them are handed over together,
// so that what came in one PDO stays together; who takes them does not wait for who gives them, nor
// the other way round. On one executor the hand-over is a call.
struct BoundLink {
  explicit BoundLink(std::vector<config::Binding> bindings_of_two_lines);

  const std::vector<config::Binding> bindings;
  const std::vector<line::Following> followings;  // of these
  exchange::Handover<std::vector<line::Line::Input>> values;
  // Who is to take them, set before either line runs. On the executor of the giving line its
  // runner, which is called; else the executor to be woken.
  LineRunner* runner = nullptr;
  exchange::Wakeup* taker = nullptr;
};

// The end where the inputs are. Of the thread that runs the line.
class BoundSource {
 public:
  explicit BoundSource(BoundLink& link);

  bool is_of(const BoundLink& link) const { return link_ == &link; }
  // Hands over what line::FollowedInputs finds. now: for the runner that is called. True if it went
  // to another executor, which is woken.
  bool look(const line::Line& line, Instant now);

 private:
  BoundLink* link_;
  line::FollowedInputs inputs_;
};

// The end where the outputs are.
class BoundTarget {
 public:
  explicit BoundTarget(BoundLink& link);

  // Gives line::FollowingOutputs what was handed over. True if anything was written.
  bool take(line::Line& line, Instant now);

  const BoundLink& link() const { return *link_; }

 private:
  BoundLink* link_;
  line::FollowingOutputs outputs_;
};

}  // namespace linegate::gateway
