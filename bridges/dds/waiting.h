// SPDX-License-Identifier: Apache-2.0
// Waits in the caller's thread for data of several readers, or for wake().
#pragma once

#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>

#include "stack/base/time.h"

namespace linegate::dds {

// Converts a time-out for Fast DDS. Negative values become 0; values beyond its range, which are
// centuries, are limited.
eprosima::fastrtps::Duration_t to_dds(Duration timeout);

class Waiting {
 public:
  Waiting();
  ~Waiting();
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  // The reader must exist until the last wait(), or until forget().
  void watch(eprosima::fastdds::dds::DataReader* reader);
  void forget(eprosima::fastdds::dds::DataReader* reader);
  // Returns true if wake() was called or a watched reader may have data. The caller must then take
  // all samples or call wake(), because the next wait() reports new samples only.
  bool wait(Duration timeout);
  // From any thread.
  void wake();

 private:
  eprosima::fastdds::dds::WaitSet set_;
  eprosima::fastdds::dds::GuardCondition woken_;
  eprosima::fastdds::dds::ConditionSeq active_;
};

}  // namespace linegate::dds
