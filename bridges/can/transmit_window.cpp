// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/transmit_window.h"

#include <algorithm>

#include "stack/base/byte_order.h"

namespace linegate::can_bridge {

TransmitWindow::TransmitWindow(std::size_t depth)
    : depth_(std::clamp<std::size_t>(depth, 1, kMaxDepth)) {
}

TransmitWindow::Mark TransmitWindow::mark(const can::Frame& frame) {
  Mark mark;
  mark.id = frame.id;
  mark.length = frame.length;
  // The bus may have set or cleared these two flags.
  mark.flags = static_cast<std::uint8_t>(
      frame.flags & ~(can::Frame::kBitRateSwitch | can::Frame::kErrorStateIndicator));
  const std::size_t bytes = frame.remote() ? 0 : std::min<std::size_t>(frame.length, 8);
  mark.head = load_le(std::span(frame.data).first(bytes));
  return mark;
}

void TransmitWindow::sent(const can::Frame& frame, Instant now, std::uint64_t number) {
  if (count_ == 0 || count_ >= depth_) {
    progress_ = now;
  }
  if (count_ >= depth_) {
    skipped_to_ = numbers_[first_];
    first_ = (first_ + 1) % kMaxDepth;
    --count_;
  }
  marks_[(first_ + count_) % kMaxDepth] = mark(frame);
  numbers_[(first_ + count_) % kMaxDepth] = number;
  ++count_;
}

std::size_t TransmitWindow::confirmed(const can::Frame& echo, Instant now) {
  const Mark wanted = mark(echo);
  for (std::size_t i = 0; i < count_; ++i) {
    if (marks_[(first_ + i) % kMaxDepth] == wanted) {
      confirmed_to_ = numbers_[(first_ + i) % kMaxDepth];
      skipped_to_ = i == 0 ? skipped_to_ : numbers_[(first_ + i - 1) % kMaxDepth];
      first_ = (first_ + i + 1) % kMaxDepth;
      count_ -= i + 1;
      progress_ = now;
      return i + 1;
    }
  }
  return 0;
}

}  // namespace linegate::can_bridge
