// Which of a line's scans are to be its configuration: those that somebody asked to apply, and
// those that the line makes by itself because it is configured by what is on it.
#pragma once

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
  // From the start of a line until its devices have come back from its NMT reset.
  static constexpr Duration kSettle = std::chrono::seconds(2);
  // From a look of a line that finds nothing to its next one.
  static constexpr Duration kAgain = std::chrono::seconds(10);

  // taken must outlive it.
  ScanTaker(const config::LinePlan& plan, exchange::Ring<TakenScan>& taken);

  // The line has started.
  void started(Instant now);
  // The scan that the line makes by itself, when it is due.
  std::optional<line::Command> due(Instant now);
  Instant next_wake() const { return due_; }

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
  Instant due_ = kNever;
  std::vector<Asked> asked_;
};

}  // namespace linegate::gateway
