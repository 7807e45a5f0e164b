// SPDX-License-Identifier: Apache-2.0
#include "stack/can/transmit_queue.h"

#include "stack/base/assert.h"

namespace linegate::can {

TransmitQueue::TransmitQueue(std::uint32_t capacity)
    : capacity_(capacity),
      mask_(std::bit_ceil(capacity) - 1),
      frames_(kTransmitClasses * (std::size_t{mask_} + 1)) {
  LINEGATE_ASSERT(capacity > 0, "a class has room for a frame");
  Frame* first = frames_.data();
  for (Ring& places : rings_) {
    places.frames = first;
    first += mask_ + 1;
  }
}

bool TransmitQueue::push(TransmitClass cls, const Frame& frame) {
  if (room(cls) == 0) {
    ++refused_;
    return false;
  }
  copy_content(frame, reserve_place(cls));
  return true;
}

bool TransmitQueue::holds(TransmitClass cls, const Header& header) const {
  return any_of(cls, [&header](const Frame& frame) {
    return frame.id == header.id && frame.flags == header.flags;
  });
}

const Frame* TransmitQueue::first(unsigned classes) const {
  if (classes == 0) {
    return nullptr;
  }
  const Ring& places = rings_[static_cast<unsigned>(std::countr_zero(classes))];
  return &places.frames[places.head];
}

void TransmitQueue::clear() {
  for (Ring& places : rings_) {
    places.head = 0;
    places.count = 0;
  }
  waiting_ = 0;
}

}  // namespace linegate::can
