// SPDX-License-Identifier: Apache-2.0
// The frames that a line is to send, in order of urgency: NMT, SYNC, EMCY, TIME, (PDO,) SDO,
// others.
//
// Transmission is pulled: the owner of the socket requests the most urgent frame when there is
// room. PDOs are not queued here: pdo::Engine keeps one frame per TPDO, always the newest. The line
// first polls this queue for the classes above PDO, then the engine, then this queue for the
// others.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/frame.h"
#include "stack/can/traffic.h"

namespace linegate::can {

enum class TransmitClass : std::uint8_t { nmt, sync, emcy, time, sdo, error_control };
inline constexpr std::size_t kTransmitClasses = 6;

class TransmitQueue {
 public:
  // capacity: places per class. Nothing is allocated after construction.
  explicit TransmitQueue(std::uint32_t capacity = 256);
  ~TransmitQueue() = default;
  TransmitQueue(const TransmitQueue&) = delete;
  TransmitQueue& operator=(const TransmitQueue&) = delete;

  // Returns false if the class is full: the frame was not queued; retry when room() returns true.
  bool push(TransmitClass cls, const Frame& frame);
  // The same for a frame of 8 bytes; data: these bytes as one little-endian number.
  bool push(TransmitClass cls, Header header, std::uint64_t data);
  // Like push(). Precondition: there is room.
  void push_into_room(TransmitClass cls, Header header, std::uint64_t data);
  std::size_t room(TransmitClass cls) const { return capacity_ - ring(cls).count; }
  // Number of queued frames of the class.
  std::size_t queued(TransmitClass cls) const { return ring(cls).count; }

  // Whether a queued frame of the class has this header. Searches linearly: not for the hot path.
  bool holds(TransmitClass cls, const Header& header) const;
  // Whether there is a queued frame of the class for which matches(frame) is true. Likewise.
  template <class Matches>
  bool any_of(TransmitClass cls, const Matches& matches) const;
  // Removes those frames. Returns whether there was one. Likewise.
  template <class Matches>
  bool remove(TransmitClass cls, const Matches& matches);

  // Removes the most urgent frame. Returns false if the queue is empty.
  bool pop(Frame& out) { return pop(waiting_, out); }
  // The same, and adds the frame to sent.
  bool pop(Frame& out, Traffic& sent) { return pop(waiting_, out, &sent); }
  // The same for NMT, SYNC, EMCY and TIME, which precede PDOs. Returns false if there is none.
  bool pop_urgent(Frame& out) { return pop(waiting_ & kUrgent, out); }
  // The same for SDO and error control, which follow PDOs. Returns false if there is none.
  bool pop_rest(Frame& out) { return pop(waiting_ & ~kUrgent, out); }

  // The frames that these three would remove; nullptr if there is none.
  const Frame* first() const { return first(waiting_); }
  const Frame* first_urgent() const { return first(waiting_ & kUrgent); }
  const Frame* first_rest() const { return first(waiting_ & ~kUrgent); }

  bool empty() const { return waiting_ == 0; }
  std::uint64_t refused() const { return refused_; }
  void clear();

 private:
  static constexpr unsigned kUrgent = (1U << static_cast<unsigned>(TransmitClass::sdo)) - 1U;

  struct Ring {
    Frame* frames = nullptr;  // mask_ + 1 elements of frames_
    std::uint32_t head = 0;
    std::uint32_t count = 0;
  };
  Ring& ring(TransmitClass cls) { return rings_[static_cast<std::size_t>(cls)]; }
  const Ring& ring(TransmitClass cls) const { return rings_[static_cast<std::size_t>(cls)]; }

  const Frame* first(unsigned classes) const;
  // Counts one more frame and returns its place. Precondition: there is room.
  Frame& reserve_place(TransmitClass cls);
  // Removes the first frame of the most urgent of these classes, none of which may be empty. sent
  // may be nullptr.
  bool pop(unsigned classes, Frame& out, Traffic* sent = nullptr);

  std::array<Ring, kTransmitClasses> rings_;
  std::uint32_t capacity_;
  std::uint32_t mask_;    // (places in a ring, a power of two) - 1
  unsigned waiting_ = 0;  // bit n: class n has frames
  std::uint64_t refused_ = 0;
  std::vector<Frame> frames_;  // the places of all rings
};

template <class Matches>
bool TransmitQueue::any_of(TransmitClass cls, const Matches& matches) const {
  const Ring& places = ring(cls);
  for (std::uint32_t i = 0; i < places.count; ++i) {
    if (matches(places.frames[(places.head + i) & mask_])) {
      return true;
    }
  }
  return false;
}

template <class Matches>
bool TransmitQueue::remove(TransmitClass cls, const Matches& matches) {
  Ring& places = ring(cls);
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < places.count; ++i) {
    const Frame& frame = places.frames[(places.head + i) & mask_];
    if (matches(frame)) {
      continue;
    }
    if (kept != i) {
      copy_content(frame, places.frames[(places.head + kept) & mask_]);
    }
    ++kept;
  }
  const bool any = kept != places.count;
  places.count = kept;
  if (kept == 0) {
    places.head = 0;
    waiting_ &= ~(1U << static_cast<unsigned>(cls));
  }
  return any;
}

inline Frame& TransmitQueue::reserve_place(TransmitClass cls) {
  LINEGATE_ASSERT_HOT(room(cls) > 0, "the class has room");
  Ring& places = ring(cls);
  const std::uint32_t place = (places.head + places.count++) & mask_;
  waiting_ |= 1U << static_cast<unsigned>(cls);
  return places.frames[place];
}

// Copies the whole header although its length is known: pop() loads adjacent fields at once and
// would stall on fields that were stored separately.
inline void TransmitQueue::push_into_room(TransmitClass cls, Header header, std::uint64_t data) {
  Frame& place = reserve_place(cls);
  place.id = header.id;
  place.length = header.length;
  place.flags = header.flags;
  store_le(place.data.data(), data);
}

inline bool TransmitQueue::push(TransmitClass cls, Header header, std::uint64_t data) {
  if (room(cls) == 0) [[unlikely]] {
    ++refused_;
    return false;
  }
  push_into_room(cls, header, data);
  return true;
}

inline bool TransmitQueue::pop(unsigned classes, Frame& out, Traffic* sent) {
  if (classes == 0) {
    return false;
  }
  const auto first = static_cast<unsigned>(std::countr_zero(classes));
  Ring& places = rings_[first];
  LINEGATE_ASSERT_HOT(places.count > 0, "a class that waits has frames");
  const std::uint32_t head = places.head;
  const Header header = copy_content(places.frames[head], out);
  if (--places.count == 0) {
    places.head = 0;  // the next frame uses a place that is still in the cache
    waiting_ &= ~(1U << first);
  } else {
    places.head = (head + 1) & mask_;
  }
  if (sent == nullptr) {
    return true;
  }
  if ((header.flags & Frame::kExtended) == 0) [[likely]] {
    sent->add_standard(header.length);
  } else {
    sent->add(header.flags, header.length);
  }
  return true;
}

}  // namespace linegate::can
