#include "stack/can/transmit_queue.h"

#include <bit>
#include <cstring>

#include "stack/base/byte_order.h"

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

inline Frame* TransmitQueue::take_place(TransmitClass cls) {
  Ring& ring = rings_[static_cast<std::size_t>(cls)];
  if (ring.count == ring.frames.size()) {
    ++refused_;
    return nullptr;
  }
  std::size_t place = ring.head + ring.count++;
  if (place >= ring.frames.size()) {
    place -= ring.frames.size();
  }
  waiting_ |= 1U << static_cast<unsigned>(cls);
  return &ring.frames[place];
}

bool TransmitQueue::push(TransmitClass cls, const Frame& frame) {
  Frame* const place = take_place(cls);
  if (place != nullptr) {
    copy(frame, *place);
  }
  return place != nullptr;
}

bool TransmitQueue::push(TransmitClass cls, CobId cob_id, std::uint64_t data) {
  Frame* const place = take_place(cls);
  if (place != nullptr) {
    place->id = cob_id.id();
    place->length = kMaxClassicData;
    place->flags = cob_id.extended() ? std::uint8_t{Frame::kExtended} : std::uint8_t{0};
    place->time = Instant{};
    store_le(place->data.data(), data);
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
  Ring& ring = rings_[static_cast<std::size_t>(std::countr_zero(classes))];
  copy(ring.frames[ring.head], out);
  if (++ring.head == ring.frames.size()) {
    ring.head = 0;
  }
  if (--ring.count == 0) {
    ring.head = 0;  // the next frame finds its place in the cache
    waiting_ &= ~(classes & (~classes + 1U));
  }
  return true;
}

}  // namespace linegate::can
