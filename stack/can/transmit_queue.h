// Frames a line wants to send, in the order of the bus: NMT, SYNC, EMCY, TIME, (PDO,) SDO, others.
//
// Transmission is pulled: whoever owns the socket asks for the most urgent frame when there is
// room. PDOs are not queued here: pdo::Engine keeps one frame per TPDO, always the newest. The line
// asks this queue for the classes above PDO first, then the engine, then the rest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::can {

enum class TransmitClass : std::uint8_t { nmt, sync, emcy, time, sdo, error_control };
inline constexpr std::size_t kTransmitClasses = 6;

class TransmitQueue {
 public:
  // Places per class. Nothing is allocated afterwards.
  explicit TransmitQueue(std::size_t capacity = 256);

  // False when the class is full: the frame was not taken, try again when room() says so.
  bool push(TransmitClass cls, const Frame& frame);
  // The same for a classical data frame of 8 bytes, given as one little-endian number.
  bool push(TransmitClass cls, CobId cob_id, std::uint64_t data);
  std::size_t room(TransmitClass cls) const {
    return capacity_ - rings_[static_cast<std::size_t>(cls)].count;
  }
  // Frames of the class that wait for the bus.
  std::size_t queued(TransmitClass cls) const;

  // NMT, SYNC, EMCY, TIME: what goes before PDOs. False if there is none.
  bool pop_urgent(Frame& out) { return (waiting_ & kUrgent) != 0 && pop(waiting_ & kUrgent, out); }
  // SDO and error control: what goes after PDOs. False if there is none.
  bool pop_rest(Frame& out) { return (waiting_ & ~kUrgent) != 0 && pop(waiting_ & ~kUrgent, out); }

  bool empty() const { return waiting_ == 0; }
  std::uint64_t refused() const { return refused_; }
  void clear();

 private:
  static constexpr unsigned kUrgent = (1U << static_cast<unsigned>(TransmitClass::sdo)) - 1U;

  struct Ring {
    std::vector<Frame> frames;  // capacity_
    std::size_t head = 0;
    std::size_t count = 0;
  };
  // The place of one more frame, which counts from now on; nullptr if the class is full.
  Frame* take_place(TransmitClass cls);
  bool pop(unsigned classes, Frame& out);

  std::size_t capacity_;
  std::array<Ring, kTransmitClasses> rings_;
  unsigned waiting_ = 0;  // bit n: class n has frames
  std::uint64_t refused_ = 0;
};

inline Frame* TransmitQueue::take_place(TransmitClass cls) {
  Ring& ring = rings_[static_cast<std::size_t>(cls)];
  if (ring.count == capacity_) {
    ++refused_;
    return nullptr;
  }
  std::size_t place = ring.head + ring.count++;
  if (place >= capacity_) {
    place -= capacity_;
  }
  waiting_ |= 1U << static_cast<unsigned>(cls);
  return &ring.frames[place];
}

inline bool TransmitQueue::push(TransmitClass cls, CobId cob_id, std::uint64_t data) {
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

}  // namespace linegate::can
