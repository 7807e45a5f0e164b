// SPDX-License-Identifier: Apache-2.0
#include "stack/line/program_service.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"

namespace linegate::line {
namespace {

ProgramFault fault_of(const manager::BootFinding& finding, Error& error) {
  switch (finding.kind) {
    case manager::BootFinding::Kind::abort:
      error = to_error(finding.abort);
      return {finding.object, 0};
    case manager::BootFinding::Kind::last:
      error = to_error(AbortCode::device_state);
      return {finding.object, kProgramRestarted};
    default:
      error = to_error(AbortCode::hardware);
      return {finding.object, finding.found};
  }
}

}  // namespace

std::span<const CommandKind> ProgramService::commands() const {
  static constexpr std::array kCommands{CommandKind::program};
  return kCommands;
}

void ProgramService::execute(Command command, Instant now) {
  Refusal why = Refusal::none;
  if (!host().manages()) {
    why = Refusal::wrong_role;
  } else if (!host().usable()) {
    why = Refusal::line_down;
  } else {
    why = begin(command, now);
  }
  if (why != Refusal::none) {
    host().refuse(command, why, now);
  }
}

// Moves the data out of the command unless it is refused.
Refusal ProgramService::begin(Command& command, Instant now) {
  auto& request = std::get<ProgramDownload>(command.request);
  const bool is_node = request.node >= can::kMinNodeId && request.node <= can::kMaxNodeId;
  if (!is_node || request.node == own_node_ || request.number == 0 || request.program.empty() ||
      request.program.size() > manager::kLongestProgram) {
    return Refusal::bad_request;
  }
  if (!manager_.active()) {
    return Refusal::wrong_state;
  }
  if (loader_.loading(request.node)) {
    return Refusal::busy;
  }
  running_.push_back(
      {.tag = command.tag,
       .client = command.client,
       .node = request.node,
       .deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever});
  manager_.hold(request.node);
  loader_.load(
      {.node = request.node,
       .number = request.number,
       .program = std::make_shared<const std::vector<std::byte>>(std::move(request.program))},
      now, command.client);
  collect(now);
  return Refusal::none;
}

void ProgramService::advance(Instant now) {
  loader_.advance(now);
  collect(now);
  expire(now);
}

void ProgramService::collect(Instant now) {
  while (const auto run = loader_.pop_ended()) {
    const auto at = std::ranges::find(running_, run->node(), &Running::node);
    if (at == running_.end()) {
      continue;
    }
    Error error{};
    ReplyData data;
    if (run->result() != manager::ProgramRun::Result::loaded) {
      const ProgramFault fault = fault_of(run->finding(), error);
      data = fault;
    }
    host().reply(at->tag, error, std::move(data));
    const std::uint32_t client = at->client;
    running_.erase(at);
    manager_.release(run->node(), now, client);
  }
}

void ProgramService::expire(Instant now) {
  std::erase_if(running_, [&](const Running& running) {
    if (running.deadline > now) {
      return false;
    }
    loader_.cancel(running.node);
    host().reply(running.tag, to_error(Refusal::timed_out), {});
    manager_.release(running.node, now, running.client);
    return true;
  });
}

void ProgramService::end(Refusal why, Instant now) {
  for (const Running& running : std::exchange(running_, {})) {
    loader_.cancel(running.node);
    host().reply(running.tag, to_error(why), {});
    manager_.release(running.node, now, running.client);
  }
}

Instant ProgramService::next_wake() const {
  Instant wake = loader_.next_wake();
  for (const Running& running : running_) {
    wake = earlier(wake, running.deadline);
  }
  return wake;
}

}  // namespace linegate::line
