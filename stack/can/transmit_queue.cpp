#include "stack/can/transmit_queue.h"

#include <bit>
#include <cstring>

namespace linegate::can {
namespace {

// Field by field: one load over fields that were just stored apart would wait for them. Data that
// the frame does not have is left alone.
void copy(const Frame& from, Frame& to) {
  to.id = from.id;
  to.length = from.length;
  to.flags = from.flags;
  to.time = from.time;
  const bool is_long = from.length > kMaxClassicData;
  std::memcpy(to.data.data(), from.data.data(), kMaxClassicData);
  if (is_long) [[unlikely]] {
    to.data = from.data;
  }
}

}  // namespace

TransmitQueue::TransmitQueue(std::size_t capacity) {
  for (Ring& ring : rings_) {
    ring.frames.resize(capacity);
  }
}

bool TransmitQueue::push(TransmitClass cls, const Frame& frame) {
  Ring& ring = rings_[static_cast<std::size_t>(cls)];
  if (ring.count == ring.frames.size()) {
    ++refused_;
    return false;
  }
  std::size_t place = ring.head + ring.count;
  if (place >= ring.frames.size()) {
    place -= ring.frames.size();
  }
  copy(frame, ring.frames[place]);
  ++ring.count;
  waiting_ |= 1U << static_cast<unsigned>(cls);
  return true;
}

std::size_t TransmitQueue::room(TransmitClass cls) const {
  const Ring& ring = rings_[static_cast<std::size_t>(cls)];
  return ring.frames.size() - ring.count;
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

// The first frame of the most urgent of these classes, all of which have frames.
bool TransmitQueue::pop(unsigned classes, Frame& out) {
  if (classes == 0) {
    return false;
  }
  Ring& ring = rings_[static_cast<std::size_t>(std::countr_zero(classes))];
  copy(ring.frames[ring.head], out);
  if (++ring.head == ring.frames.size()) {
    ring.head = 0;
  }
  if (--ring.count == 0) {
    waiting_ &= ~(classes & (~classes + 1U));
  }
  return true;
}

}  // namespace linegate::can
