// SPDX-License-Identifier: Apache-2.0
// What Fast DDS itself has to say, in the gateway's log.
#pragma once

#include <mutex>
#include <string_view>

#include "gateway/publish/rate_limit.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// As long as it lives, the library's warnings and errors go to the log: what comes too often is
// left out and counted. After it the library is silent.
class LibraryLogger {
 public:
  LibraryLogger();
  ~LibraryLogger();
  LibraryLogger(const LibraryLogger&) = delete;
  LibraryLogger& operator=(const LibraryLogger&) = delete;

  // From any thread.
  void write(Severity severity, std::string_view text, Instant now);

 private:
  std::mutex mutex_;
  RateLimit limit_;
};

}  // namespace linegate::gateway
