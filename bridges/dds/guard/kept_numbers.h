// SPDX-License-Identifier: Apache-2.0
// How many sequence numbers of a writer a reader here may keep. Fast DDS 2.9.1 keeps each number of
// a GAP above the first one that it misses (64 octets), so one GAP could cost 1 GB.
#pragma once

#include <algorithm>
#include <atomic>
#include <utility>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// The first number that the reader misses is taken from its own ACKNACKs, which nobody else can
// forge. A GAP that begins there or below costs no memory. The others are counted until the reader
// misses none below them. One that is left out comes again: the writer has to send a GAP from the
// first missing number on, as after a loss.
class KeptNumbers {
 public:
  static constexpr Number kFew = 256;                    // of each writer
  static constexpr Number kMost = Number{1} << 17;       // of one that discovery found: 8 MB
  static constexpr Number kMostOfAll = Number{1} << 19;  // all that exceed kFew: 32 MB

  KeptNumbers() = default;
  KeptNumbers(const KeptNumbers&) = delete;
  KeptNumbers& operator=(const KeptNumbers&) = delete;
  KeptNumbers& operator=(KeptNumbers&& other) noexcept {
    std::swap(missing_, other.missing_);
    std::swap(highest_, other.highest_);
    std::swap(kept_, other.kept_);
    std::swap(of_all_, other.of_all_);
    return *this;
  }
  KeptNumbers(KeptNumbers&& other) noexcept { *this = std::move(other); }
  ~KeptNumbers() { count(0); }

  // A GAP goes through `listed` numbers, >= 1, from `first` on. False: it is to be left out.
  // found: discovery found the writer. of_all: the sum of all writers, which outlives this.
  bool keep(Number first, Number listed, bool found, std::atomic<Number>& of_all) {
    if (first <= missing_)
      return true;
    of_all_ = &of_all;
    if (listed > (found ? kMost : kFew) - kept_ || !count(kept_ + listed))
      return false;
    highest_ = std::max(highest_, first + listed - 1);
    return true;
  }

  // A reader here acknowledged all numbers below that one; 0: it just began.
  void acknowledged(Number below) {
    missing_ = std::max(below, Number{1});
    count(std::clamp(highest_ - missing_, Number{0}, kept_));
  }

 private:
  static Number shared(Number kept) { return std::max(kept - kFew, Number{0}); }

  bool count(Number kept) {
    const Number more = shared(kept) - shared(kept_);
    if (more != 0 && of_all_->fetch_add(more, std::memory_order_relaxed) + more > kMostOfAll &&
        more > 0) {
      of_all_->fetch_sub(more, std::memory_order_relaxed);
      return false;
    }
    kept_ = kept;
    return true;
  }

  Number missing_ = 1;  // the first one
  Number highest_ = 0;  // of those that are counted
  Number kept_ = 0;     // at most
  std::atomic<Number>* of_all_ = nullptr;
};

}  // namespace linegate::dds::guard
