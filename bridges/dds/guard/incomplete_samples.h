// SPDX-License-Identifier: Apache-2.0
// Limits the incomplete samples of one writer, of which some fragments were received, but not all.
// Fast DDS 2.9.1 reserves memory for a whole sample with the first of its fragments, and keeps it
// until the sample is complete or the writer has removed it: a datagram of 150 octets costs as much
// as the largest sample.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "bridges/dds/guard/submessages.h"
#include "bridges/dds/guard/tokens.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// A token bucket of octets. The first fragment takes the octets of its sample; the last one returns
// them. The tokens of samples that remain incomplete because the writer replaced them are
// replenished by time. A HEARTBEAT or GAP returns nothing, because it is unknown whether the
// library accepts it. Times in nanoseconds of any clock.
class IncompleteSamples {
 public:
  // Least octets that a sample is charged: even a small one costs 4.4 KiB, an entry of the library
  // and one page. A reader with PREALLOCATED_WITH_REALLOC reserves the largest sample of its type,
  // but touches only as much of it as the sample has.
  static constexpr std::uint32_t kLeast = 8192;

  // Records the fragments of the sample `number` in a submessage. A different size makes it a
  // different sample, because the library may have reserved memory for either. Returns false if the
  // submessage must be dropped. A reliable writer repeats it later, when there are tokens again.
  bool add(Number number, const Fragments& fragments, std::int64_t now) {
    Sample* sample = find(number, fragments);
    if (sample == nullptr)
      sample = begin(number, fragments, now);
    if (sample == nullptr)
      return false;
    sample->used = now;
    if (sample->missing != 0 && take(*sample, fragments) == 0 && sample->complete_is_certain())
      octets_.give(price(sample->octets));
    return true;
  }

 private:
  static constexpr std::size_t kPlaces = 32;
  static constexpr std::uint32_t kBits = 64;

  struct Sample {
    bool has_bits() const { return (octets - 1) / size < kBits; }
    // If only octets are counted, repeated fragments complete a sample, too. They have cost the
    // sender as many octets.
    bool complete_is_certain() const { return has_bits() || octets >= kLeast; }

    Number number = 0;  // 0: free
    std::int64_t used = INT64_MIN;
    std::uint64_t missing = 0;  // one bit for each fragment; above 64 fragments: number of octets
    std::uint32_t octets = 0;
    std::uint32_t size = 0;  // of a fragment
  };

  static Number price(std::uint32_t octets) { return std::max(octets, kLeast); }
  static std::uint64_t bits(std::uint32_t count) { return ~std::uint64_t{0} >> (kBits - count); }

  // Returns what is still missing.
  static std::uint64_t take(Sample& sample, const Fragments& it) {
    if (sample.has_bits())
      sample.missing &= ~(bits(it.count) << (it.first - 1));
    else
      sample.missing -= std::min(sample.missing, it.octets);
    return sample.missing;
  }

  Sample* find(Number number, const Fragments& it) {
    auto* const found = std::find_if(samples_.begin(), samples_.end(), [&](const Sample& sample) {
      return sample.number == number && sample.octets == it.sample && sample.size == it.size;
    });
    return found == samples_.end() ? nullptr : found;
  }

  // Replaces the least recently used sample, whose tokens are not returned unless it is complete.
  // Complete samples are kept, so that repeated fragments do not begin a new one.
  Sample* begin(Number number, const Fragments& it, std::int64_t now) {
    if (!octets_.take(price(it.sample), now))
      return nullptr;
    auto* const place =
        std::min_element(samples_.begin(), samples_.end(),
                         [](const Sample& a, const Sample& b) { return a.used < b.used; });
    *place = {number, now, it.sample, it.sample, it.size};
    if (place->has_bits())
      place->missing = bits((it.sample + it.size - 1) / it.size);
    return place;
  }

  std::array<Sample, kPlaces> samples_{};
  Tokens<kMaxSample, 2'384> octets_;  // 4 MiB in 10 s
};

}  // namespace linegate::dds::guard
