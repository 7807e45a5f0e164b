// SPDX-License-Identifier: Apache-2.0
// Limits the sequence numbers of a writer that a local reader keeps. Fast DDS 2.9.1 stores each
// number of a GAP above the first one that it misses (64 octets), so one GAP could cost 1 GB.
#pragma once

#include <algorithm>
#include <atomic>
#include <utility>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// The first missing number is taken from the reader's own ACKNACKs, which no other host can forge.
// A GAP that begins at or below it costs no memory. Numbers of other GAPs are counted until the
// reader misses no number below them. A dropped GAP is repeated: the writer must send a GAP from
// the first missing number on, as after a loss.
class KeptNumbers {
 public:
  static constexpr Number kFew = 256;               // of each writer, discovered or not
  static constexpr Number kMost = Number{1} << 17;  // of a discovered writer: 8 MB
  // Of all writers, beyond kFew of each: 32 MB
  static constexpr Number kMostOfAll = Number{1} << 19;

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

  // Counts a GAP of `listed` numbers, >= 1, from `first` on. Returns false if it must be dropped.
  // found: the writer was discovered. of_all: the sum over all writers, which outlives this object.
  bool keep(Number first, Number listed, bool found, std::atomic<Number>& of_all) {
    if (first <= missing_)
      return true;
    of_all_ = &of_all;
    if (listed > (found ? kMost : kFew) - kept_ || !count(kept_ + listed))
      return false;
    highest_ = std::max(highest_, first + listed - 1);
    return true;
  }

  // A local reader acknowledged all numbers below that one; 0: it has just started.
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

  Number missing_ = 1;  // the first missing number
  Number highest_ = 0;  // the highest counted number
  Number kept_ = 0;     // upper bound of the numbers that are kept
  std::atomic<Number>* of_all_ = nullptr;
};

}  // namespace linegate::dds::guard
