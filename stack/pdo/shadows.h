// SPDX-License-Identifier: Apache-2.0
// The last frame of each synchronous RPDO, until the next SYNC, and of any RPDO received before
// Operational, until Operational.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/time.h"

namespace linegate::pdo {

struct Shadow {
  std::uint64_t word = 0;    // the first 8 bytes of the last frame
  Instant time{};            // of the last frame
  std::uint32_t frames = 0;  // since the last SYNC; 0 if the PDO was changed meanwhile
  std::uint16_t slot = 0;
};

// Shadows are stored contiguously, in the order of their first frames, so that a SYNC commits them
// in one pass. The place of a shadow is stored by slot; it is valid only if the shadow at that
// place has this slot, so that places need not be cleared.
class Shadows {
 public:
  // Allocates space for that many RPDOs, all without a frame.
  void reset(std::size_t slots) {
    shadows_.assign(slots + 1, {});
    places_.assign(slots, 0);
    size_ = 0;
  }
  void clear() { size_ = 0; }
  // Drops the frame of the slot.
  void remove(std::uint16_t slot) {
    if (holds(slot)) {
      shadows_[places_[slot]].frames = 0;
    }
  }

  std::size_t size() const { return size_; }
  const Shadow& operator[](std::size_t place) const { return shadows_[place]; }
  // The shadows from `place` on.
  std::span<const Shadow> from(std::size_t place) const {
    return std::span(shadows_).subspan(place, size_ - place);
  }
  // Returns nullptr if there was no frame since the last SYNC.
  const Shadow* find(std::uint16_t slot) const {
    return holds(slot) && shadows_[places_[slot]].frames != 0 ? &shadows_[places_[slot]] : nullptr;
  }

  // Adds a frame. The first one since a SYNC needs no look at what was kept before.
  void keep(std::uint16_t slot, std::uint64_t word, Instant time) {
    if (size_ != 0) {
      Series(*this).keep(slot, word, time);
      return;
    }
    Shadow& first = shadows_.front();
    first.word = word;
    first.time = time;
    first.frames = 1;
    first.slot = slot;
    places_[slot] = 0;
    size_ = 1;
  }

  // Adds successive frames, while the shadows are not accessed otherwise.
  class Series {
   public:
    explicit Series(Shadows& shadows)
        : all_(shadows),
          shadows_(shadows.shadows_.data()),
          places_(shadows.places_.data()),
          size_(shadows.size_) {}
    ~Series() { all_.size_ = size_; }
    Series(const Series&) = delete;
    Series& operator=(const Series&) = delete;

    // No branch: whether a slot is new cannot be predicted.
    void keep(std::uint16_t slot, std::uint64_t word, Instant time) {
      const std::size_t known = places_[slot];
      const bool is_new = known >= size_ || shadows_[known].slot != slot;
      const std::size_t place = is_new ? size_ : known;
      const std::uint32_t before = is_new ? 0 : shadows_[place].frames;
      Shadow& shadow = shadows_[place];
      shadow.word = word;
      shadow.time = time;
      shadow.frames = before + 1;
      shadow.slot = slot;
      places_[slot] = static_cast<std::uint16_t>(place);
      size_ += is_new ? 1 : 0;
    }

   private:
    Shadows& all_;
    Shadow* const shadows_;
    std::uint16_t* const places_;
    std::size_t size_;
  };

 private:
  bool holds(std::uint16_t slot) const {
    const std::size_t place = places_[slot];
    return place < size_ && shadows_[place].slot == slot;
  }

  std::vector<Shadow> shadows_;        // the first size_ are used; one more than there are slots
  std::vector<std::uint16_t> places_;  // by slot
  std::size_t size_ = 0;
};

}  // namespace linegate::pdo
