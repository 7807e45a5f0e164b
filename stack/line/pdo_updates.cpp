// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_updates.h"

#include <algorithm>

#include "stack/base/time.h"

namespace linegate::line {

void PdoUpdates::written(const image::Entry& entry, std::uint32_t of_pdo, bool at_once,
                         Instant now) {
  auto it = std::ranges::find(waiting_, entry.local_pdo, &Waiting::pdo);
  if (it == waiting_.end()) {
    waiting_.push_back({.pdo = entry.local_pdo, .begin = entry.bit_offset, .offsets = {}});
    it = waiting_.end() - 1;
  }
  it->begin = std::min(it->begin, entry.bit_offset);
  it->end = std::max(it->end, entry.bit_offset + entry.bit_length);
  if (std::ranges::find(it->offsets, entry.bit_offset) == it->offsets.end()) {
    it->offsets.push_back(entry.bit_offset);
  }
  const bool due = at_once || it->offsets.size() == of_pdo;
  it->deadline = due ? now : deadline(now, update_time_);
}

PdoUpdates::Due PdoUpdates::expire(Instant now) {
  const auto it = std::ranges::find_if(
      waiting_, [now](const Waiting& waiting) { return waiting.deadline <= now; });
  if (it == waiting_.end()) {
    return {};
  }
  const Due due{it->pdo, it->begin, it->end - it->begin};
  waiting_.erase(it);
  return due;
}

void PdoUpdates::forget(std::uint16_t pdo) {
  std::erase_if(waiting_, [pdo](const Waiting& waiting) { return waiting.pdo == pdo; });
}

bool PdoUpdates::waits(std::uint16_t pdo) const {
  return std::ranges::find(waiting_, pdo, &Waiting::pdo) != waiting_.end();
}

Instant PdoUpdates::next_wake() const {
  Instant wake = kNever;
  for (const Waiting& waiting : waiting_) {
    wake = earlier(wake, waiting.deadline);
  }
  return wake;
}

}  // namespace linegate::line
