// SPDX-License-Identifier: Apache-2.0
#include "stack/line/frames_under_way.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"

namespace linegate::line {

void FramesUnderWay::add(Sending sending) {
  LINEGATE_ASSERT(sendings_.size() < kMost, "one more command may wait");
  sendings_.push_back(std::move(sending));
}

[[gnu::hot]] bool FramesUnderWay::ended(std::uint64_t number, Instant now) {
  if (number <= ended_) {
    return false;
  }
  end(number);
  progress_ = now;
  return true;
}

// Precondition: number > ended_.
[[gnu::hot]] void FramesUnderWay::end(std::uint64_t number) {
  LINEGATE_ASSERT_HOT(number > ended_, "the frame is later than those that ended");
  ended_ = std::min(number, handed_out_);
  if (lost_first_ != 0 && lost_first_ <= ended_ + 1) {
    ended_ = std::max(ended_, std::min(lost_last_, handed_out_));
    lost_first_ = 0;
  }
  requests_.ended(ended_);
}

bool FramesUnderWay::is_sent(const Sending& sending, std::uint64_t number) {
  const auto has_ended = [number](const Awaited& awaited) {
    return awaited.number != 0 && awaited.number <= number;
  };
  return sending.any_frame ? std::ranges::any_of(sending.frames, has_ended)
                           : std::ranges::all_of(sending.frames, has_ended);
}

ReplyData FramesUnderWay::take_data(Sending& sending, std::uint64_t number) {
  LINEGATE_ASSERT(is_sent(sending, number), "the frames were acknowledged");
  if (sending.any_frame) {
    const auto sent = std::ranges::find_if(sending.frames, [number](const Awaited& awaited) {
      return awaited.number != 0 && awaited.number <= number;
    });
    std::get<WrittenByPdo>(sending.data).pdo = sent->sender();
  }
  return std::move(sending.data);
}

void FramesUnderWay::lost(std::uint64_t first, std::uint64_t last) {
  for (Sending& sending : sendings_) {
    for (Awaited& awaited : sending.frames) {
      if (awaited.number >= first && awaited.number <= last) {
        // The next frame of its PDO sends the value again.
        awaited.number = awaited.sender() != 0 && !awaited.is_only ? 0 : kLost;
      }
    }
  }
  std::erase_if(sendings_, [](const Sending& sending) {
    return sending.is_report() && sending.frames.front().number == kLost;
  });
  if (last <= ended_) {
    return;
  }
  if (first <= ended_ + 1) {
    end(last);
  } else {
    lost_first_ =
        lost_first_ != 0 && first <= lost_last_ + 1 ? std::min(lost_first_, first) : first;
    lost_last_ = last;
  }
}

std::vector<FramesUnderWay::Sending> FramesUnderWay::give_up_values(
    const std::function<bool(const Command&)>& is_gone) {
  std::vector<Sending> unsent;
  std::erase_if(sendings_, [&](Sending& sending) {
    if (sending.is_report() || !is_gone(sending.command)) {
      return false;
    }
    if (!sending.is_handed_out()) {
      unsent.push_back(std::move(sending));
      return true;
    }
    std::erase_if(sending.frames, [](const Awaited& awaited) { return awaited.number == 0; });
    for (Awaited& awaited : sending.frames) {
      awaited.is_only = true;
    }
    return false;
  });
  return unsent;
}

Instant FramesUnderWay::next_deadline() const {
  Instant first = kNever;
  for (const Sending& sending : sendings_) {
    first = earlier(first, sending.deadline);
  }
  return first;
}

}  // namespace linegate::line
