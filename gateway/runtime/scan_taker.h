// SPDX-License-Identifier: Apache-2.0
// Which of a line's scans are to be its configuration: those that somebody asked to apply, and
// those that the line makes by itself because it is configured by what is on it.
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
struct TakenScan {
  std::uint8_t node = 0;          // 0 = all
  std::uint16_t code = 0;         // line::kScan... bits
  std::vector<std::byte> report;  // scan/report.h
};

// On the thread of its line.
class ScanTaker {
 public:
  // From the start of a line until its devices have come back from its NMT reset, and from the
  // boot-up message of a device until it is ready.
  static constexpr Duration kSettle = std::chrono::seconds(2);
  // From a look of a line that finds nothing to its next one.
  static constexpr Duration kAgain = std::chrono::seconds(10);

  // taken must outlive it.
  ScanTaker(const config::LinePlan& plan, exchange::Ring<TakenScan>& taken);

  // The line has started.
  void started(Instant now);
  // The scan that the line makes by itself, when it is due.
  std::optional<line::Command> due(Instant now);
  // Of due(), or of holds().
  Instant next_wake() const { return earlier(due_, held_until_.value_or(kNever)); }

  // Commands wait, which the restart of the line would cut off: of a result that was handed on the
  // line is made anew; and one that was made so has its devices come back first.
  bool holds(Instant now);
  // Nothing became of the result, the line goes on as it is.
  void kept() { held_until_.reset(); }

  // That node booted up. One that a line which is configured by its scans does not know came late,
  // and is scanned, too.
  void booted_up(std::uint8_t node, Instant now);

  // The command goes to the line.
  void asked(const line::Command& command);
  // A reply of the line; a result that is to be applied is handed on. True if the scan was the
  // line's own: the reply is for nobody else.
  bool answered(const line::Reply& reply);

 private:
  struct Asked {
    std::uint64_t tag = 0;
    std::uint8_t node = 0;
    std::uint16_t code = 0;
  };

  bool wanted_;  // the line scans by itself
  std::uint16_t code_;
  exchange::Ring<TakenScan>& taken_;
  bool made_of_scan_;  // the line
  bool takes_late_comers_;
  std::bitset<128> known_;
  std::bitset<128> late_;
  Instant due_ = kNever;
  std::optional<Instant> held_until_;  // kNever: until somebody has taken the result
  std::vector<Asked> asked_;
};

}  // namespace linegate::gateway
