// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/process_ends.h"

#include <chrono>
#include <utility>

#include <fmt/format.h>

namespace linegate::gateway {

void ProcessEnds::note(event::ProcessEnd cause, std::uint32_t detail, Duration pause,
                       std::string words) {
  const std::lock_guard lock(mutex_);
  newest_.cause = cause;
  newest_.detail = detail;
  newest_.pause_ms = static_cast<std::uint32_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(pause).count());
  ++newest_.ends;
  words_ = std::move(words);
}

std::optional<EdgeNotice> ProcessEnds::pop(Instant now) {
  const std::lock_guard lock(mutex_);
  if (newest_.ends == 0 || (reported_ && now - *reported_ < kPeriod)) {
    return std::nullopt;
  }
  std::string text =
      fmt::format("the DDS process {}; it is started again{}", words_,
                  newest_.pause_ms == 0 ? "" : fmt::format(" in {} ms", newest_.pause_ms));
  if (newest_.ends > 1) {
    text += fmt::format("; {} ends since the last report", newest_.ends);
  }
  reported_ = now;
  EdgeNotice out{newest_, std::move(text)};
  newest_.ends = 0;
  return out;
}

}  // namespace linegate::gateway
