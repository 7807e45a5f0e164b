#include "stack/can/transmit_queue.h"

namespace linegate::can {

TransmitQueue::TransmitQueue(std::uint32_t capacity)
    : capacity_(capacity), frames_(kTransmitClasses * capacity) {
  Frame* first = frames_.data();
  for (Ring& places : rings_) {
    places.frames = first;
    first += capacity;
  }
}

bool TransmitQueue::push(TransmitClass cls, const Frame& frame) {
  Frame* const place = take_place(cls);
  if (place != nullptr) {
    copy(frame, *place);
  }
  return place != nullptr;
}

void TransmitQueue::clear() {
  for (Ring& places : rings_) {
    places.head = 0;
    places.count = 0;
  }
  waiting_ = 0;
}

}  // namespace linegate::can
