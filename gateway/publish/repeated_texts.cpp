// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/repeated_texts.h"

#include <algorithm>
#include <utility>

namespace linegate::gateway {

bool RepeatedTexts::admit(Severity severity, std::string_view text, Instant now) {
  if (text.size() > kLongest) {
    return true;
  }
  Place* free = nullptr;
  for (Place& place : places_) {
    if (place.until <= now) {
      free = &place;
    } else if (place.written.severity == severity && place.written.text == text) {
      ++place.written.suppressed;
      return false;
    }
  }
  if (free != nullptr) {
    *free = {.written = {.severity = severity, .text = std::string(text)}, .until = now + kPeriod};
  }
  return true;
}

std::optional<RepeatedTexts::Joined> RepeatedTexts::pop_due(Instant now) {
  const auto due = std::ranges::find_if(places_, [now](const Place& place) {
    return place.written.suppressed != 0 && place.until <= now;
  });
  if (due == places_.end()) {
    return std::nullopt;
  }
  // The message goes on: the next ones are joined, too.
  due->until = now + kPeriod;
  Joined out = due->written;
  due->written.suppressed = 0;
  return out;
}

}  // namespace linegate::gateway
