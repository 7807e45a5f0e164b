// SPDX-License-Identifier: Apache-2.0
// Selects the scans of a line whose results become its configuration: those of the command
// scan_apply, and those that a line with automatic scan makes itself.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/ring.h"
#include "stack/base/time.h"
#include "stack/line/command.h"

namespace linegate::gateway {

// The result of a scan that was applied.
struct AppliedScan {
  line::ScanApply request;
  std::vector<scan::ScannedNode> nodes;
};

// Used by the thread of its line.
class ScanApplier {
 public:
  // Time from the start of a line until its devices have booted after its NMT reset, and from the
  // boot-up message of a device until it is ready.
  static constexpr Duration kSettle = std::chrono::seconds(2);
  // Time from an automatic scan that found nothing to the next one.
  static constexpr Duration kAgain = std::chrono::seconds(10);

  // taken must outlive it.
  ScanApplier(const config::LinePlan& plan, exchange::Ring<AppliedScan>& taken);

  // The line has started.
  void started(Instant now);
  // Returns the automatic scan when it is due.
  std::optional<line::Command> due(Instant now);
  // The time of due(), or of holds().
  Instant next_wake() const { return earlier(due_, held_until_.value_or(kNever)); }

  // Whether commands must wait, because a restart of the line would cancel them: after a result was
  // handed on, until the line is made anew from it; and in the new line until its devices have
  // booted.
  bool holds(Instant now);
  // The result was not applied, and the line continues unchanged.
  void kept() { held_until_.reset(); }

  // That node booted up. If the line is configured by its scans and the node is not in its
  // configuration, it is scanned, too.
  void booted_up(std::uint8_t node, Instant now);

  // The command is passed to the line.
  void asked(const line::Command& command);
  // Call it with each reply of the line; hands on a result that is to be applied. Returns true if
  // the scan was an automatic one: nobody else awaits the reply.
  bool answered(const line::Reply& reply);

 private:
  struct Asked {
    std::uint64_t tag = 0;
    line::ScanApply request;
  };

  // First: the line asks for next_wake() in each round.
  Instant due_ = kNever;
  std::optional<Instant> held_until_;  // kNever: until the main thread has taken the result

  bool wanted_;  // the line scans automatically
  bool sets_up_;
  exchange::Ring<AppliedScan>& taken_;
  bool made_of_scan_;  // the line was made from a scan
  bool takes_late_comers_;
  std::bitset<128> known_;
  std::bitset<128> late_;
  std::vector<Asked> asked_;
};

}  // namespace linegate::gateway
