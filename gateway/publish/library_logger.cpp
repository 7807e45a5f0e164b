// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/library_logger.h"

#include <spdlog/spdlog.h>

#include "gateway/publish/foreign_text.h"

namespace linegate::gateway {

void LibraryLogger::write(Severity severity, std::string_view text, Instant now) {
  std::uint64_t left_out = 0;
  {
    const std::lock_guard lock(mutex_);
    if (!limit_.admit(now, left_out)) {
      return;
    }
  }
  const auto level = severity == Severity::error ? spdlog::level::err : spdlog::level::warn;
  if (left_out > 0) {
    spdlog::log(level, "Fast DDS: {} ({} more messages left out)", printable(text), left_out);
  } else {
    spdlog::log(level, "Fast DDS: {}", printable(text));
  }
}

}  // namespace linegate::gateway
