// SPDX-License-Identifier: Apache-2.0
// Limits how far the sequence numbers of one writer may advance. Fast DDS 2.9.1 processes every
// number between the old and the new one (0.12 us each for a HEARTBEAT), and every number of a GAP,
// including known ones (0.35 us), so a single datagram could occupy it forever (CVE-2025-64438,
// CVE-2025-65016). For each number of a GAP it searches the samples that the reader keeps: those of
// SEDP are all known endpoints (2.3 us with some hundred), so SEDP has lower limits.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "bridges/dds/guard/kept_numbers.h"
#include "bridges/dds/guard/sample_times.h"
#include "bridges/dds/guard/tokens.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// A GAP of at most so many numbers costs no more than a datagram.
inline constexpr Number kFewNumbers = 256;
inline constexpr Number kFewAnnouncements = 32;  // of SEDP

// Longest time, in ns, that the library needs for one number of a GAP, on a slow machine.
inline constexpr std::int64_t kWalkTime = 1'000;

// Token buckets of sequence numbers. Times in nanoseconds of any clock.
class WriterNumbers {
 public:
  static constexpr std::int64_t kPrice = 10'000;     // ns of waiting a number: 100,000 a second
  static constexpr Number kBurst = Number{1} << 20;  // most tokens saved
  // Limit of a writer's first number, also after kSilence: a GAP or HEARTBEAT positions a late
  // joiner behind all samples that the writer ever wrote.
  static constexpr Number kFirst = Number{1} << 24;
  static constexpr Number kFirstOfSedp = Number{1} << 17;  // endpoints announced and ended
  static constexpr Number kFirstCredit = 4096;
  static constexpr std::int64_t kSilence = 10'000'000'000;

  // A submessage has `to`, >= 0, as the writer's highest number. most: limit of the first number,
  // kFirst or kFirstOfSedp. Returns false if the submessage must be dropped.
  bool advance(Number to, std::int64_t now, Number most = kFirst) {
    const bool first = at_ == kNever;
    const bool anew = first || now - at_ >= kSilence;
    if (first && to > most)
      return false;
    earn(first, now);
    at_ = now;
    if (to <= high_)
      return true;
    if (!anew || to > most) {
      if (to - high_ > saved_ / kPrice)
        return false;
      saved_ -= (to - high_) * kPrice;
    }
    high_ = to;
    return true;
  }

  // A GAP contains `listed` numbers. Returns false if it must be dropped. A writer with holes in
  // its history repeats its GAPs with each HEARTBEAT, so known numbers cost tokens, too.
  bool walk(Number listed, std::int64_t now) {
    return listed <= kFewNumbers || walked_.take(listed, now);
  }

  // The writer was lost. Some of its samples may be unread, and it may be discovered again, so its
  // timestamps are kept.
  void forget() {
    WriterNumbers anew;
    anew.times = times;
    *this = std::move(anew);
  }

  KeptNumbers kept;
  SampleTimes times;

 private:
  static constexpr std::int64_t kNever = INT64_MIN;

  void earn(bool first, std::int64_t now) {
    const std::int64_t earned = first ? kFirstCredit * kPrice : now - at_;
    saved_ =
        std::min(kBurst * kPrice, saved_ + std::clamp(earned, std::int64_t{0}, kBurst * kPrice));
  }

  Number high_ = 0;
  std::int64_t saved_ = 0;  // ns
  std::int64_t at_ = kNever;
  Tokens<2 * kFirst, 2'000> walked_;  // half a million a second
};

// For the GAPs of all writers together: a million numbers a second, which occupy a third of a core.
using WalkedNumbers = Tokens<Number{1} << 26, 1'000>;

// For the GAPs of all writers of SEDP together: 0.6 s at once, and a thirteenth of a core.
using WalkedAnnouncements = Tokens<Number{1} << 18, 30'000>;

}  // namespace linegate::dds::guard
