// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/waiting.h"

#include <algorithm>
#include <limits>

namespace linegate::dds {

namespace fast = eprosima::fastdds::dds;

eprosima::fastrtps::Duration_t to_dds(Duration timeout) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max() * kSecond;
  const std::int64_t ns = std::clamp<std::int64_t>(timeout.count(), 0, kMost);
  return {static_cast<std::int32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond)};
}

Waiting::Waiting() {
  set_.attach_condition(woken_);
}

Waiting::~Waiting() {
  fast::ConditionSeq attached;
  set_.get_conditions(attached);
  for (fast::Condition* condition : attached)
    set_.detach_condition(*condition);
}

void Waiting::watch(fast::DataReader* reader) {
  fast::StatusCondition& condition = reader->get_statuscondition();
  condition.set_enabled_statuses(fast::StatusMask::data_available());
  set_.attach_condition(condition);
}

void Waiting::forget(fast::DataReader* reader) {
  set_.detach_condition(reader->get_statuscondition());
}

bool Waiting::wait(Duration timeout) {
  const bool any = set_.wait(active_, to_dds(timeout)) == ReturnCode_t::RETCODE_OK;
  woken_.set_trigger_value(false);
  return any;
}

void Waiting::wake() {
  woken_.set_trigger_value(true);
}

}  // namespace linegate::dds
