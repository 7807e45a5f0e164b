// SPDX-License-Identifier: Apache-2.0
// How much of one writer may be incomplete: samples of which some fragments came, but not all. Fast
// DDS 2.9.1 reserves a whole sample with the first of its fragments, and keeps it until the sample
// is complete or the writer has it no longer: a datagram of 150 octets costs as much as the largest
// sample.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "bridges/dds/guard/submessages.h"
#include "bridges/dds/guard/tokens.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// A token bucket of octets: the first fragment takes those of its sample, the last one gives them
// back. Samples that stay incomplete because the writer replaced them are paid by time. A HEARTBEAT
// or GAP gives nothing back: whether the library takes it does not show. Times in nanoseconds of
// any clock.
class IncompleteSamples {
 public:
  // What even a small one counts: it costs 4.4 KiB, an entry of the library and a page begun. A
  // reader with PREALLOCATED_WITH_REALLOC reserves the largest sample of its type, but touches no
  // more of it than the sample has.
  static constexpr std::uint32_t kLeast = 8192;

  // A submessage has these fragments of the sample `number`. Another size makes it another sample:
  // the library may have reserved either. False: it is to be dropped. A reliable writer repeats
  // what is dropped when there are tokens again.
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
    // Where only octets are counted, repeated ones complete a sample, too. They have cost the
    // sender as much.
    bool complete_is_certain() const { return has_bits() || octets >= kLeast; }

    Number number = 0;  // 0: free
    std::int64_t used = INT64_MIN;
    std::uint64_t missing = 0;  // a bit for each fragment; of more than 64: octets
    std::uint32_t octets = 0;
    std::uint32_t size = 0;  // of a fragment
  };

  static Number price(std::uint32_t octets) { return std::max(octets, kLeast); }
  static std::uint64_t bits(std::uint32_t count) { return ~std::uint64_t{0} >> (kBits - count); }

  // What is missing then.
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

  // In the place of the longest unused one: what was taken for it is not given back, unless it is
  // complete. Complete ones are kept, so that repeated fragments begin no sample.
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
