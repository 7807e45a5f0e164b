// SPDX-License-Identifier: Apache-2.0
// Writes the messages of Fast DDS to the log.
#pragma once

#include <mutex>
#include <string_view>

#include "gateway/publish/rate_limit.h"
#include "gateway/publish/repeated_texts.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// Joins equal messages, limits the rate of all, and counts suppressed ones. The number is written
// with a later message. Leaves out one that states nothing wrong.
class LibraryLogger {
 public:
  // From any thread.
  void write(Severity severity, std::string_view text, Instant now);

 private:
  std::mutex mutex_;
  RepeatedTexts repeats_;
  RateLimit limit_;
};

}  // namespace linegate::gateway
