// SPDX-License-Identifier: Apache-2.0
// Waiting for data of several readers, or for being woken, in the caller's thread.
#pragma once

#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>

#include "stack/base/time.h"

namespace linegate::dds {

// A time-out as Fast DDS takes it; none below 0, and what is beyond its range is centuries anyway.
eprosima::fastrtps::Duration_t to_dds(Duration timeout);

class Waiting {
 public:
  Waiting();
  ~Waiting();
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  // The reader must outlive the last wait(), or be forgotten before.
  void watch(eprosima::fastdds::dds::DataReader* reader);
  void forget(eprosima::fastdds::dds::DataReader* reader);
  // True: woken, or a watched reader may have data; its samples must then be taken until there are
  // none, or wake() be called, since the next wait() tells of new ones only.
  bool wait(Duration timeout);
  // From any thread.
  void wake();

 private:
  eprosima::fastdds::dds::WaitSet set_;
  eprosima::fastdds::dds::GuardCondition woken_;
  eprosima::fastdds::dds::ConditionSeq active_;
};

}  // namespace linegate::dds
