// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/double_answers.h"

#include <algorithm>

#include "stack/od/objects.h"
#include "stack/sdo/protocol.h"

namespace linegate::sdo {
namespace {

// An answer, possibly an abort, to the first frame of an expedited or segmented transfer.
bool begins_transfer(std::uint64_t word) {
  const unsigned specified = specifier(static_cast<std::uint8_t>(word));
  return specified == static_cast<unsigned>(ServerCommand::upload_initiate) ||
         specified == static_cast<unsigned>(ServerCommand::download_initiate) ||
         specified == static_cast<unsigned>(ServerCommand::abort);
}

bool is_value(std::uint64_t word) {
  return specifier(static_cast<std::uint8_t>(word)) ==
         static_cast<unsigned>(ServerCommand::upload_initiate);
}

// Objects whose value is the same in every answer of a device.
bool is_constant(od::Address address) {
  return address.index == od::objects::kDeviceType || address.index == od::objects::kIdentity;
}

bool within(Instant since, Instant now, Duration time) {
  return since != kNever && now - since < time;
}

}  // namespace

DoubleAnswers::Found DoubleAnswers::response(std::uint64_t word, bool asked, Instant now) {
  if (!begins_transfer(word)) {
    return Found::nothing;
  }
  if (asked) {
    std::rotate(answers_.begin(), answers_.begin() + 1, answers_.end());
    answers_.back() = {.word = word, .time = now};
    return Found::nothing;
  }
  const od::Address address = multiplexer(word);
  if (within(cancelled_at_, now, kLate) && cancelled_ == address) {
    cancelled_at_ = kNever;
    return Found::second_answer;
  }
  const auto first = std::find_if(answers_.rbegin(), answers_.rend(), [&](const Answer& answer) {
    return within(answer.time, now, kLate) && multiplexer(answer.word) == address;
  });
  if (first == answers_.rend() || first->twice) {
    return Found::nothing;
  }
  first->twice = true;
  const bool differs =
      first->word != word && is_constant(address) && is_value(first->word) && is_value(word);
  if (within(disturbed_, now, kUndisturbed) || within(reported_, now, kQuiet) ||
      (!differs && !in_a_row(now))) {
    return Found::second_answer;
  }
  reported_ = now;
  return Found::two_devices;
}

void DoubleAnswers::cancel(od::Address address, Instant now) {
  forget();
  cancelled_ = address;
  cancelled_at_ = now;
}

void DoubleAnswers::forget() {
  answers_ = {};
}

bool DoubleAnswers::in_a_row(Instant now) const {
  unsigned row = 0;
  for (const Answer& answer : answers_) {
    row = answer.twice && within(answer.time, now, kRow) ? row + 1U : 0U;
    if (row == kInARow) {
      return true;
    }
  }
  return false;
}

}  // namespace linegate::sdo
