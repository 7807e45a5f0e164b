// SPDX-License-Identifier: Apache-2.0
#include "stack/line/program_command.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/deadline.h"
#include "stack/can/cob_id.h"

namespace linegate::line {

Refusal ProgramCommand::begin(Command command, Instant now) {
  const bool is_node = command.node >= can::kMinNodeId && command.node <= can::kMaxNodeId;
  if (!is_node || command.sub == 0 || command.data.empty() ||
      command.data.size() > manager::kLongestProgram) {
    return Refusal::bad_request;
  }
  if (!manager_.active()) {
    return Refusal::wrong_state;
  }
  if (loader_.loading(command.node)) {
    return Refusal::busy;
  }
  running_.push_back(
      {.tag = command.tag,
       .node = command.node,
       .deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever});
  manager_.hold(command.node);
  loader_.load({.node = command.node,
                .number = command.sub,
                .program = std::make_shared<const std::vector<std::byte>>(std::move(command.data))},
               now);
  collect(now);
  return Refusal::none;
}

void ProgramCommand::advance(Instant now) {
  collect(now);
  expire(now);
}

void ProgramCommand::collect(Instant now) {
  while (const auto run = loader_.take_ended()) {
    const auto at = std::ranges::find(running_, run->node(), &Running::node);
    if (at == running_.end()) {
      continue;
    }
    Reply reply{.tag = at->tag, .error = {}, .data = {}};
    if (run->result() != manager::ProgramRun::Result::loaded) {
      const manager::BootFinding& finding = run->finding();
      reply.error = to_error(
          finding.kind == manager::BootFinding::Kind::abort ? finding.abort : AbortCode::hardware);
      reply.data = write_finding(finding);
    }
    replies_.push_back(std::move(reply));
    running_.erase(at);
    manager_.release(run->node(), now);
  }
}

void ProgramCommand::expire(Instant now) {
  std::erase_if(running_, [&](const Running& running) {
    if (running.deadline > now) {
      return false;
    }
    loader_.cancel(running.node);
    replies_.push_back({.tag = running.tag, .error = to_error(Refusal::timed_out), .data = {}});
    manager_.release(running.node, now);
    return true;
  });
}

void ProgramCommand::end(Refusal why, Instant now) {
  for (const Running& running : std::exchange(running_, {})) {
    loader_.cancel(running.node);
    replies_.push_back({.tag = running.tag, .error = to_error(why), .data = {}});
    manager_.release(running.node, now);
  }
}

Instant ProgramCommand::next_wake() const {
  Instant wake = kNever;
  for (const Running& running : running_) {
    wake = earlier(wake, running.deadline);
  }
  return wake;
}

std::optional<Reply> ProgramCommand::take_reply() {
  if (replies_.empty()) {
    return std::nullopt;
  }
  Reply out = std::move(replies_.front());
  replies_.pop_front();
  return out;
}

std::vector<std::byte> write_finding(const manager::BootFinding& finding) {
  std::vector<std::byte> out(7);
  store_le(std::span(out).first(2), finding.object.index);
  out[2] = std::byte{finding.object.sub};
  store_le(std::span(out).last(4), finding.found);
  return out;
}

}  // namespace linegate::line
