// Samples of one writer of which some fragments came, but not all. Fast DDS 2.9.1 reserves a whole
// sample with the first of its fragments, and keeps it until the sample is complete or the writer
// has it no longer: a datagram of 150 octets costs as much as the largest sample.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "bridges/dds/guard/submessages.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// Counts octets, not fragments: a fragment that comes twice counts twice, so to have a sample taken
// as complete costs a sender as many octets. A HEARTBEAT or GAP ends no sample here: whether the
// library takes it does not show. Times in nanoseconds of any clock.
class IncompleteSamples {
 public:
  static constexpr std::size_t kMost = 8;                   // at once
  static constexpr std::uint64_t kMostOctets = kMaxSample;  // of them all, whole
  static constexpr std::int64_t kStale = 10'000'000'000;    // ns without a fragment

  // A submessage has `octets` of the sample `number`, > 0, which has `size`. Another size makes it
  // another sample: the library may have reserved either. False: it is to be dropped. A reliable
  // writer repeats what is dropped when there is room again.
  bool add(Number number, std::uint32_t size, std::uint64_t octets, std::int64_t now) {
    Sample* sample = find(number, size);
    if (sample == nullptr)
      sample = begin(number, size, now);
    if (sample == nullptr)
      return false;
    sample->left -= static_cast<std::uint32_t>(std::min<std::uint64_t>(sample->left, octets));
    sample->used = now;
    return true;
  }

 private:
  struct Sample {
    Number number = 0;  // 0: free
    std::int64_t used = 0;
    std::uint32_t size = 0;
    std::uint32_t left = 0;  // 0: complete. Kept, so that repeated fragments begin no sample
  };

  Sample* find(Number number, std::uint32_t size) {
    auto* const found = std::find_if(samples_.begin(), samples_.end(), [&](const Sample& it) {
      return it.number == number && it.size == size;
    });
    return found == samples_.end() ? nullptr : found;
  }

  // In the place of the longest unused one that is complete or stale.
  Sample* begin(Number number, std::uint32_t size, std::int64_t now) {
    Sample* place = nullptr;
    std::uint64_t reserved = size;
    for (Sample& it : samples_) {
      const bool waits = it.left != 0 && now - it.used < kStale;
      reserved += waits ? it.size : 0;
      if (!waits && (place == nullptr || it.number == 0 || it.used < place->used))
        place = place != nullptr && place->number == 0 ? place : &it;
    }
    if (place != nullptr && reserved <= kMostOctets)
      *place = {number, now, size, size};
    return place != nullptr && reserved <= kMostOctets ? place : nullptr;
  }

  std::array<Sample, kMost> samples_{};
};

}  // namespace linegate::dds::guard
