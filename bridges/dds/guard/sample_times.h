// SPDX-License-Identifier: Apache-2.0
// Replaces the source timestamps of the samples of one writer before Fast DDS 2.9.1 reads them.
//
// A reader inserts a sample into its history with a comparison (ChangeComparison.hpp) by sequence
// number for samples of the same writer, and by source timestamp for samples of different writers.
// This is a consistent order only if the timestamps of each writer increase strictly with its
// numbers: then a lower number has an earlier timestamp, the comparison is by timestamp alone, and
// in the history, which is sorted by timestamp, the numbers of each writer are in order. Otherwise
// (a late number with a later or an equal timestamp, and a timestamp of another writer in between)
// a number may be inserted behind a higher one of its writer, where it is not found when it is
// notified (History::get_change_nts stops at the first higher number). Its instance is then read
// although it was never counted, and the next sample of that instance aborts the process
// (DataReaderInstance.hpp:105, assertion).
//
// Therefore the timestamp is a function of the number: the timestamp of the first received sample,
// plus 2^-32 s for each further number. The timestamps of later samples have no effect, and neither
// has a sender's clock that is set back. The first timestamp is at most the time of its reception:
// a full history keeps the samples with the later timestamps, so a writer that claims a time in the
// future would displace the samples of all others.
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
  static SampleTime no_limit() { return std::numeric_limits<SampleTime>::max(); }

  // Greater than the highest number (kLastNumber), so that no timestamp overflows.
  static constexpr SampleTime kMargin = SampleTime{1} << 49;

  // The timestamp of the sample `number`, 1 to 2^48. sent: its received timestamp; 0: none. utc:
  // the present time, which is called for the first sample only.
  SampleTime of(Number number, SampleTime sent, SampleTime (*utc)() = no_limit) {
    if (!begun_) {
      constexpr SampleTime kEarliest = std::numeric_limits<SampleTime>::min() + kMargin;
      constexpr SampleTime kLatest = std::numeric_limits<SampleTime>::max() - kMargin;
      begun_ = true;
      zero_ = std::clamp(std::min(sent, utc()), kEarliest, kLatest) - number;
    }
    return zero_ + number;
  }

 private:
  SampleTime zero_ = 0;  // timestamp of number 0
  bool begun_ = false;
};

}  // namespace linegate::dds::guard
