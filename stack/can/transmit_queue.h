// Frames a line wants to send, in the order of the bus: NMT, SYNC, EMCY, TIME, (PDO,) SDO, others.
//
// Transmission is pulled: whoever owns the socket asks for the most urgent frame when there is
// room. PDOs are not queued here: pdo::Engine keeps one frame per TPDO, always the newest. The line
// asks this queue for the classes above PDO first, then the engine, then the rest.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/can/frame.h"

namespace linegate::can {

enum class TransmitClass : std::uint8_t { nmt, sync, emcy, time, sdo, error_control };
inline constexpr std::size_t kTransmitClasses = 6;

class TransmitQueue {
 public:
  // Places per class. Nothing is allocated afterwards.
  explicit TransmitQueue(std::uint32_t capacity = 256);
  ~TransmitQueue() = default;
  TransmitQueue(const TransmitQueue&) = delete;
  TransmitQueue& operator=(const TransmitQueue&) = delete;

  // False when the class is full: the frame was not taken, try again when room() says so.
  bool push(TransmitClass cls, const Frame& frame);
  // The same for a frame of 8 bytes, which are given as one little-endian number.
  bool push(TransmitClass cls, Header header, std::uint64_t data);
  std::size_t room(TransmitClass cls) const { return capacity_ - ring(cls).count; }
  // Frames of the class that wait for the bus.
  std::size_t queued(TransmitClass cls) const { return ring(cls).count; }

  // The most urgent frame. False if there is none.
  bool pop(Frame& out) { return pop(waiting_, out); }
  // NMT, SYNC, EMCY, TIME: what goes before PDOs. False if there is none.
  bool pop_urgent(Frame& out) { return pop(waiting_ & kUrgent, out); }
  // SDO and error control: what goes after PDOs. False if there is none.
  bool pop_rest(Frame& out) { return pop(waiting_ & ~kUrgent, out); }

  bool empty() const { return waiting_ == 0; }
  std::uint64_t refused() const { return refused_; }
  void clear();

 private:
  static constexpr unsigned kUrgent = (1U << static_cast<unsigned>(TransmitClass::sdo)) - 1U;

  struct Ring {
    Frame* frames = nullptr;  // capacity_ of frames_
    std::uint32_t head = 0;
    std::uint32_t count = 0;
  };
  Ring& ring(TransmitClass cls) { return rings_[static_cast<std::size_t>(cls)]; }
  const Ring& ring(TransmitClass cls) const { return rings_[static_cast<std::size_t>(cls)]; }

  static void copy(const Frame& from, Frame& to);
  // The place of one more frame, which counts from now on; nullptr if the class is full.
  Frame* take_place(TransmitClass cls);
  // The first frame of the most urgent of these classes, each of which has frames.
  bool pop(unsigned classes, Frame& out);

  std::array<Ring, kTransmitClasses> rings_;
  std::uint32_t capacity_;
  unsigned waiting_ = 0;  // bit n: class n has frames
  std::uint64_t refused_ = 0;
  std::vector<Frame> frames_;  // of all rings
};

// Field by field: one load over fields that were just stored apart would wait for them. Data that
// the frame does not have is left alone.
inline void TransmitQueue::copy(const Frame& from, Frame& to) {
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

inline Frame* TransmitQueue::take_place(TransmitClass cls) {
  Ring& places = ring(cls);
  if (places.count == capacity_) [[unlikely]] {
    ++refused_;
    return nullptr;
  }
  std::uint32_t place = places.head + places.count++;
  if (place >= capacity_) {
    place -= capacity_;
  }
  waiting_ |= 1U << static_cast<unsigned>(cls);
  return &places.frames[place];
}

// All of the header is copied although its length is known: pop() loads in one what is side by
// side, and would wait for fields that were stored apart.
inline bool TransmitQueue::push(TransmitClass cls, Header header, std::uint64_t data) {
  Frame* const place = take_place(cls);
  if (place == nullptr) {
    return false;
  }
  place->id = header.id;
  place->length = header.length;
  place->flags = header.flags;
  place->time = Instant{};
  store_le(place->data.data(), data);
  return true;
}

inline bool TransmitQueue::pop(unsigned classes, Frame& out) {
  if (classes == 0) {
    return false;
  }
  const auto first = static_cast<unsigned>(std::countr_zero(classes));
  Ring& places = rings_[first];
  const std::uint32_t head = places.head;
  copy(places.frames[head], out);
  if (--places.count == 0) {
    places.head = 0;  // the next frame finds its place in the cache
    waiting_ &= ~(1U << first);
  } else {
    places.head = head + 1 == capacity_ ? 0 : head + 1;
  }
  return true;
}

}  // namespace linegate::can
