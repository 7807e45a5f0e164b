#include "stack/can/transmit_queue.h"

#include <bit>
#include <cstring>

namespace linegate::can {
namespace {

// Field by field: one load over fields that were just stored apart would wait for them. Data that
// the frame does not have is left alone.
void copy(const Frame& from, Frame& to) {
  const std::uint32_t id = from.id;
  const std::uint8_t length = from.length;
  const std::uint8_t flags = from.flags;
  const Instant time = from.time;
  to.id = id;
  to.length = length;
  to.flags = flags;
  to.time = time;
  std::memcpy(to.data.data(), from.data.data(), kMaxClassicData);
  if (length > kMaxClassicData) [[unlikely]] {
    to.data = from.data;
  }
}

}  // namespace

TransmitQueue::TransmitQueue(std::size_t capacity) : capacity_(capacity) {
  for (Ring& ring : rings_) {
    ring.frames.resize(capacity);
  }
}

bool TransmitQueue::push(TransmitClass cls, const Frame& frame) {
  Frame* const place = take_place(cls);
  if (place != nullptr) {
    copy(frame, *place);
  }
  return place != nullptr;
}

std::size_t TransmitQueue::queued(TransmitClass cls) const {
  return rings_[static_cast<std::size_t>(cls)].count;
}

void TransmitQueue::clear() {
  for (Ring& ring : rings_) {
    ring.head = 0;
    ring.count = 0;
  }
  waiting_ = 0;
}

// The first frame of the most urgent of these classes: some, and all of them have frames.
bool TransmitQueue::pop(unsigned classes, Frame& out) {
  const unsigned first = classes & (~classes + 1U);
  Ring& ring = rings_[static_cast<unsigned>(std::bit_width(first)) - 1U];
  const std::size_t head = ring.head;
  copy(ring.frames[head], out);
  ring.head = head + 1 == capacity_ ? 0 : head + 1;
  if (--ring.count == 0) {
    ring.head = 0;  // the next frame finds its place in the cache
    waiting_ &= ~first;
  }
  return true;
}

}  // namespace linegate::can
