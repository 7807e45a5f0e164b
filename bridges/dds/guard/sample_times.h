// SPDX-License-Identifier: Apache-2.0
// Source timestamps of the samples of one writer as Fast DDS 2.9.1 shall see them.
//
// A reader inserts a sample into its history with a comparison (ChangeComparison.hpp) that goes by
// sequence number for samples of one writer, and by source timestamp for those of two. It is an
// order only if the timestamps of each writer rise strictly with its numbers: then a lower number
// is an earlier timestamp, so the comparison is that of timestamps alone, and the history sorted by
// timestamp has the numbers of each writer in their order. Otherwise (a late number with a later or
// an equal timestamp, another writer's timestamp between) a number may come to lie behind a higher
// one of its writer, where it is not found when it is notified (History::get_change_nts ends at the
// first higher number). Its instance is then read, but was never counted, and the next sample of
// that instance ends the process (DataReaderInstance.hpp:105, assertion).
//
// Therefore the timestamp is a function of the number: that of the first sample that came, and
// 2^-32 s for each number further. What the sender puts into later ones has no effect, so neither
// has a clock that is set back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// In 2^-32 s. Seconds are signed, as Fast DDS compares them.
using SampleTime = std::int64_t;

class SampleTimes {
 public:
  // Further than a number can go (kLastNumber), so that no timestamp wraps.
  static constexpr SampleTime kMargin = SampleTime{1} << 49;

  // Of the sample `number`, 1 to 2^48. sent: its timestamp as it was received; 0: none.
  SampleTime of(Number number, SampleTime sent) {
    if (!begun_) {
      constexpr SampleTime kEarliest = std::numeric_limits<SampleTime>::min() + kMargin;
      constexpr SampleTime kLatest = std::numeric_limits<SampleTime>::max() - kMargin;
      begun_ = true;
      zero_ = std::clamp(sent, kEarliest, kLatest) - number;
    }
    return zero_ + number;
  }

 private:
  SampleTime zero_ = 0;  // of number 0
  bool begun_ = false;
};

}  // namespace linegate::dds::guard
