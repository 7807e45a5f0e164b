// SPDX-License-Identifier: Apache-2.0
#include "stack/line/boot_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/line/state.h"
#include "stack/manager/state.h"

namespace linegate::line {
namespace {

// The boot letter of a node that is not in the network list (CiA 302-2).
constexpr char kNotListed = 'A';

}  // namespace

std::span<const CommandKind> BootService::commands() const {
  static constexpr std::array kCommands{CommandKind::boot};
  return kCommands;
}

void BootService::execute(Command command, Instant now) {
  const std::uint8_t node = std::get<line::Boot>(command.request).node;
  if (node > can::kMaxNodeId || node == own_node_) {
    host().refuse(command, Refusal::bad_request, now);
    return;
  }
  if (!host().manages()) {
    host().refuse(command, Refusal::wrong_role, now);
    return;
  }
  if (!host().usable()) {
    host().refuse(command, Refusal::line_down, now);
    return;
  }
  if (boots_.size() >= kMost) {
    host().refuse(command, Refusal::busy, now);
    return;
  }
  Boot boot{.tag = command.tag};
  boot.deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (node == id || (node == 0 && manager_.node(id).configured)) {
      boot.nodes.push_back(id);
    }
  }
  manager_.boot(node, now, command.client);
  boots_.push_back(std::move(boot));
  advance(now);
}

void BootService::advance(Instant now) {
  std::erase_if(boots_, [&](const Boot& boot) {
    if (is_concluded(boot)) {
      host().reply(boot.tag, Error{}, report(boot));
      return true;
    }
    if (boot.deadline > now) {
      return false;
    }
    host().reply(boot.tag, to_error(Refusal::timed_out), {});
    return true;
  });
}

Instant BootService::next_wake() const {
  Instant wake = kNever;
  for (const Boot& boot : boots_) {
    wake = earlier(wake, boot.deadline);
  }
  return wake;
}

void BootService::end(Refusal why, Instant /*now*/) {
  for (const Boot& boot : std::exchange(boots_, {})) {
    host().reply(boot.tag, to_error(why), {});
  }
}

bool BootService::is_concluded(const Boot& boot) const {
  return std::ranges::all_of(boot.nodes,
                             [this](std::uint8_t id) { return manager_.concluded(id); });
}

std::vector<manager::BootOutcome> BootService::report(const Boot& boot) const {
  std::vector<manager::BootOutcome> outcomes;
  for (const std::uint8_t id : boot.nodes) {
    const manager::NodeState& booted = manager_.node(id);
    outcomes.push_back({.node = id,
                        .letter = booted.configured ? booted.boot : kNotListed,
                        .finding = booted.finding});
  }
  return outcomes;
}

}  // namespace linegate::line
