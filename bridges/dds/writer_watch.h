// SPDX-License-Identifier: Apache-2.0
// Which writers a reader has lost: Fast DDS tells of them to a listener only, one by one, and not
// by a sample.
#pragma once

#include <mutex>
#include <utility>
#include <vector>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>

#include "bridges/dds/waiting.h"

namespace linegate::dds {

class WriterWatch : public eprosima::fastdds::dds::DataReaderListener {
 public:
  using Handle = eprosima::fastdds::dds::InstanceHandle_t;

  explicit WriterWatch(Waiting& waiting) : waiting_(&waiting) {}

  // What the reader's listener must be called for.
  static eprosima::fastdds::dds::StatusMask statuses() {
    auto mask = eprosima::fastdds::dds::StatusMask::liveliness_changed();
    return mask << eprosima::fastdds::dds::StatusMask::subscription_matched();
  }

  // From now on nobody is woken: `waiting` may go.
  void close() {
    const std::lock_guard lock(mutex_);
    waiting_ = nullptr;
  }

  // Those lost since the last call; a writer may be named twice.
  std::vector<Handle> take_lost() {
    const std::lock_guard lock(mutex_);
    return std::exchange(lost_, {});
  }

  // From threads of Fast DDS: they only note it.
  void on_liveliness_changed(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::LivelinessChangedStatus& status) override {
    if (status.not_alive_count_change > 0 || status.alive_count_change < 0) {
      note(status.last_publication_handle);
    }
  }
  void on_subscription_matched(
      eprosima::fastdds::dds::DataReader*,
      const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override {
    if (status.current_count_change < 0)
      note(status.last_publication_handle);
  }

 private:
  void note(const Handle& handle) {
    const std::lock_guard lock(mutex_);
    lost_.push_back(handle);
    if (waiting_ != nullptr)
      waiting_->wake();
  }

  std::mutex mutex_;
  Waiting* waiting_;
  std::vector<Handle> lost_;
};

}  // namespace linegate::dds
