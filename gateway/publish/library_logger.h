// SPDX-License-Identifier: Apache-2.0
// Writes the messages of Fast DDS to the log.
#pragma once

#include <mutex>
#include <string_view>

#include "gateway/publish/rate_limit.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// Limits the rate of messages, and counts suppressed ones.
class LibraryLogger {
 public:
  // From any thread.
  void write(Severity severity, std::string_view text, Instant now);

 private:
  std::mutex mutex_;
  RateLimit limit_;
};

}  // namespace linegate::gateway
