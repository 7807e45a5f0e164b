// SPDX-License-Identifier: Apache-2.0
// The ends of a process with DDS as events of the gateway, and its condition in words.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "gateway/edge/edge_process.h"
#include "gateway/publish/data_edge.h"
#include "stack/base/events.h"
#include "stack/base/time.h"

namespace linegate::gateway {

// Joins ends that follow each other, so that a process that dies again and again does not fill the
// events. All functions may be called from different threads.
class ProcessEnds {
 public:
  // Between two events. A process that cannot run at all is started every 30 s.
  static constexpr Duration kPeriod = std::chrono::seconds(60);

  explicit ProcessEnds(event::DdsProcess process) : newest_{.ends = 0, .process = process} {}

  // words: the reason, as in "the DDS process was ended by signal 9 (Killed)": without a subject.
  // now: the time of the end.
  void note(event::ProcessEnd cause, std::uint32_t detail, Duration pause, std::string words,
            Instant now);
  // The ends since the last event, with the cause, pause and words of the newest one, its time if
  // it waited for kPeriod, and the number of ends of each cause. Empty if there are none, or the
  // last event is more recent than kPeriod.
  std::optional<EdgeNotice> pop(Instant now);

  using Condition = EdgeProcess::Options::Condition;
  // start_due: of Condition::waits.
  void set_condition(Condition condition, Instant start_due);
  // For the status of the service: "DDS process not running, started again in 4 s". Empty while it
  // works, and if there is none.
  std::string condition(Instant now) const;

 private:
  std::string text(Instant now) const;

  mutable std::mutex mutex_;
  event::DdsProcessEnded newest_;
  Instant ended_{};  // the newest one
  std::string words_;
  std::map<event::ProcessEnd, std::uint32_t> causes_;  // of the ends to report
  bool waited_ = false;                                // a pop() was too early for them
  std::optional<Instant> reported_;
  Condition condition_ = Condition::working;
  Instant start_due_{};
};

}  // namespace linegate::gateway
