// SPDX-License-Identifier: Apache-2.0
#include "stack/line/scan_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/line/diagnosis_service.h"
#include "stack/line/record_service.h"
#include "stack/scan/describe.h"
#include "stack/scan/scanned_node.h"

namespace linegate::line {

namespace {

// A scan that is not applied sets nothing up.
ScanApply request_of(const Command& command) {
  const auto* const apply = std::get_if<ScanApply>(&command.request);
  return apply != nullptr ? *apply : ScanApply{.node = node_of(command)};
}

}  // namespace

ScanService::ScanService(ServiceHost& host, const LineConfig& config, const Parts& parts)
    : Service(host),
      config_(config),
      parts_(parts),
      scanner_(parts.sdo, *this, parts.events, *this),
      cache_(config.scanned) {
}

std::span<const CommandKind> ScanService::commands() const {
  static constexpr std::array kCommands{CommandKind::scan, CommandKind::scan_apply};
  return kCommands;
}

void ScanService::execute(Command command, Instant now) {
  if (const Refusal why = check(command); why != Refusal::none) {
    host().refuse(command, why, now);
    return;
  }
  if (!begin(request_of(command), command.client, now)) {
    host().refuse(command, Refusal::busy, now);
    return;
  }
  tag_ = command.tag;
  deadline_ = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
  conclude();
}

Refusal ScanService::check(const Command& command) const {
  const bool applies = std::holds_alternative<ScanApply>(command.request);
  const std::uint8_t node = node_of(command);
  if (node > can::kMaxNodeId || (node != 0 && node == config_.node_id)) {
    return Refusal::bad_request;
  }
  if (!host().manages()) {
    return Refusal::wrong_role;
  }
  if (applies && !config_.nodes.empty() && config_.scanned.empty()) {
    return Refusal::wrong_state;
  }
  return host().usable() ? Refusal::none : Refusal::line_down;
}

bool ScanService::begin(std::uint8_t node, Instant now, std::uint32_t client) {
  const bool begun = begin(ScanApply{.node = node}, client, now);
  conclude();
  return begun;
}

bool ScanService::begin(const ScanApply& request, std::uint32_t client, Instant now) {
  const bool one = request.node != 0;
  if (!scanner_.begin({.first = one ? request.node : can::kMinNodeId,
                       .last = one ? request.node : can::kMaxNodeId,
                       .except = config_.node_id,
                       .timeout = config_.sdo_timeout,
                       .restore_defaults = request.restore,
                       .client = client},
                      now)) {
    return false;
  }
  client_ = client;
  if (request.restore) {
    parts_.manager.stop(now);  // it would configure the nodes that boot again
  }
  tag_.reset();
  deadline_ = kNever;
  of_all_ = !one;
  sets_up_ = request.set_up;
  parts_.diagnosing.diagnosis().scan_begins(request.node);
  return true;
}

void ScanService::completed(sdo::Completion& completion, Instant now) {
  scanner_.completed(completion, now);
  conclude();
}

void ScanService::advance(Instant now) {
  scanner_.advance(now);
  conclude();
  expire(now);
}

Instant ScanService::next_wake() const {
  return earlier(scanner_.next_wake(), deadline_);
}

void ScanService::conclude() {
  auto found = scanner_.pop_result();
  if (!found) {
    return;
  }
  deadline_ = kNever;
  parts_.diagnosing.diagnosis().scan_ends();
  if (sets_up_) {
    scan::set_up(*found, parts_.records.settings().heartbeat);
  }
  if (tag_) {
    host().reply(*tag_, Error{}, *found);
  }
  cache(*std::move(found));
}

void ScanService::cache(std::vector<scan::ScannedNode> found) {
  for (scan::ScannedNode& fresh : found) {
    const auto known = std::ranges::lower_bound(cache_, fresh.id, {}, &scan::ScannedNode::id);
    if (known != cache_.end() && known->id == fresh.id) {
      *known = std::move(fresh);
    } else {
      cache_.insert(known, std::move(fresh));
    }
  }
}

void ScanService::expire(Instant now) {
  if (deadline_ <= now) {
    end(Refusal::timed_out, now);
    if (parts_.manager.state() == ManagerState::stopped) {
      parts_.manager.boot(0, now, client_);  // because of the command
    }
  }
}

void ScanService::end(Refusal why, Instant now) {
  if (!scanner_.active()) {
    return;
  }
  scanner_.cancel(now);
  (void)scanner_.pop_result();
  deadline_ = kNever;
  parts_.diagnosing.diagnosis().scan_ends();
  if (tag_) {
    host().reply(*tag_, to_error(why), {});
  }
}

void ScanService::reset_node(std::uint8_t node, Instant now) {
  parts_.nmt.send_nmt(nmt::Command::reset_node, node, now);
  parts_.sdo.charge(client_, 1);
}

void ScanService::asked(std::uint8_t node, bool answered, Instant asked_at, Instant now) {
  parts_.manager.scanned(node, answered, asked_at, now);
}

const std::vector<std::byte>* ScanService::cached(std::uint8_t node, od::Address address) const {
  const auto known = std::ranges::find(cache_, node, &scan::ScannedNode::id);
  return known == cache_.end() ? nullptr : known->find(address);
}

void ScanService::forget_cached(std::uint8_t node, od::Address address) {
  const auto known = std::ranges::find(cache_, node, &scan::ScannedNode::id);
  if (known != cache_.end()) {
    std::erase_if(known->values, [&](const auto& value) { return value.address == address; });
  }
}

}  // namespace linegate::line
