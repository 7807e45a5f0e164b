// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/library_logger.h"

#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "gateway/publish/foreign_text.h"

namespace linegate::gateway {

namespace {

// In a secured domain Fast DDS 2.9.1 writes it for each own endpoint without a peer, whenever it
// receives a submessage (AESGCMGMAC_Transform::lookup_writer): 150 times a second while one client
// reads.
constexpr std::string_view kOfEachSubmessage = "No key material yet";

spdlog::level::level_enum level_of(Severity severity) {
  return severity == Severity::error ? spdlog::level::err : spdlog::level::warn;
}

}  // namespace

void LibraryLogger::write(Severity severity, std::string_view text, Instant now) {
  if (text == kOfEachSubmessage) {
    return;
  }
  std::uint64_t left_out = 0;
  std::vector<RepeatedTexts::Joined> repeated;
  bool admitted = false;
  {
    const std::lock_guard lock(mutex_);
    while (auto joined = repeats_.pop_due(now)) {
      repeated.push_back(*std::move(joined));
    }
    admitted = repeats_.admit(severity, text, now) && limit_.admit(now, left_out);
  }
  for (const RepeatedTexts::Joined& one : repeated) {
    spdlog::log(level_of(one.severity), "Fast DDS: {} ({} more suppressed)", printable(one.text),
                one.suppressed);
  }
  if (!admitted) {
    return;
  }
  const auto level = level_of(severity);
  if (left_out > 0) {
    spdlog::log(level, "Fast DDS: {} ({} more messages left out)", printable(text), left_out);
  } else {
    spdlog::log(level, "Fast DDS: {}", printable(text));
  }
}

}  // namespace linegate::gateway
