// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/scan_applier.h"

#include <algorithm>

#include "stack/base/time.h"

namespace linegate::gateway {
namespace {

constexpr std::uint64_t kOwnTag = ~std::uint64_t{0};  // the bridge counts from 1
constexpr Duration kLongest = std::chrono::minutes(15);

}  // namespace

ScanApplier::ScanApplier(const config::LinePlan& plan, exchange::Ring<AppliedScan>& taken)
    : wanted_(plan.auto_scan && plan.auto_scan->at_start && plan.config.nodes.empty()),
      sets_up_(plan.auto_scan && plan.auto_scan->set_up),
      taken_(taken),
      made_of_scan_(!plan.config.scanned.empty()),
      takes_late_comers_(plan.auto_scan && plan.auto_scan->at_start && made_of_scan_) {
  known_.set(plan.config.node_id & 0x7FU);
  for (const line::NodeConfig& node : plan.config.nodes) {
    known_.set(node.id & 0x7FU);
  }
}

void ScanApplier::booted_up(std::uint8_t node, Instant now) {
  if (takes_late_comers_ && !known_.test(node & 0x7FU)) {
    late_.set(node & 0x7FU);
    due_ = earlier(due_, deadline(now, kSettle));
  }
}

void ScanApplier::started(Instant now) {
  due_ = wanted_ ? deadline(now, kSettle) : kNever;
  if (made_of_scan_) {
    held_until_ = deadline(now, kSettle);
  }
}

bool ScanApplier::holds(Instant now) {
  if (held_until_ && *held_until_ <= now) {
    held_until_.reset();
  }
  return held_until_.has_value();
}

std::optional<line::Command> ScanApplier::due(Instant now) {
  if (now < due_) {
    return std::nullopt;
  }
  due_ = wanted_ ? deadline(now, kAgain) : kNever;
  line::ScanApply request{.set_up = sets_up_};
  for (std::uint8_t node = 1; late_.count() == 1 && node < late_.size(); ++node) {
    request.node = late_.test(node) ? node : request.node;  // more than one: scan all nodes
  }
  late_.reset();
  const line::Command command{.tag = kOwnTag, .timeout = kLongest, .request = request};
  asked(command);
  return command;
}

void ScanApplier::asked(const line::Command& command) {
  if (const auto* const request = std::get_if<line::ScanApply>(&command.request)) {
    asked_.push_back({command.tag, *request});
  }
}

bool ScanApplier::answered(const line::Reply& reply) {
  const auto known = std::ranges::find(asked_, reply.tag, &Asked::tag);
  if (known == asked_.end()) {
    return false;
  }
  const bool own = reply.tag == kOwnTag;
  const auto* const nodes = std::get_if<std::vector<scan::ScannedNode>>(&reply.data);
  if (reply.ok() && nodes != nullptr && !(own && nodes->empty())) {
    // If the ring is full, other results already wait.
    (void)taken_.push({known->request, *nodes});
    due_ = kNever;
    held_until_ = kNever;
  }
  asked_.erase(known);
  return own;
}

}  // namespace linegate::gateway
