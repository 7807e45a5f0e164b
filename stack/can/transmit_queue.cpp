#include "stack/can/transmit_queue.h"

#include <algorithm>

namespace linegate::can {

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
  ring.frames[(ring.head + ring.count) % ring.frames.size()] = frame;
  ++ring.count;
  return true;
}

std::size_t TransmitQueue::room(TransmitClass cls) const {
  const Ring& ring = rings_[static_cast<std::size_t>(cls)];
  return ring.frames.size() - ring.count;
}

std::size_t TransmitQueue::queued(TransmitClass cls) const {
  return rings_[static_cast<std::size_t>(cls)].count;
}

bool TransmitQueue::pop_urgent(Frame& out) {
  return pop(TransmitClass::nmt, out) || pop(TransmitClass::sync, out) ||
         pop(TransmitClass::emcy, out) || pop(TransmitClass::time, out);
}

bool TransmitQueue::pop_rest(Frame& out) {
  return pop(TransmitClass::sdo, out) || pop(TransmitClass::error_control, out);
}

bool TransmitQueue::empty() const {
  return std::ranges::all_of(rings_, [](const Ring& ring) { return ring.count == 0; });
}

void TransmitQueue::clear() {
  for (Ring& ring : rings_) {
    ring.head = 0;
    ring.count = 0;
  }
}

bool TransmitQueue::pop(TransmitClass cls, Frame& out) {
  Ring& ring = rings_[static_cast<std::size_t>(cls)];
  if (ring.count == 0) {
    return false;
  }
  out = ring.frames[ring.head];
  ring.head = (ring.head + 1) % ring.frames.size();
  --ring.count;
  return true;
}

}  // namespace linegate::can
