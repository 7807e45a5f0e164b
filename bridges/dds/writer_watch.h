// SPDX-License-Identifier: Apache-2.0
// Records which writers a reader has lost: Fast DDS reports them one by one to a listener only, not
// with a sample.
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

  // The statuses for which the listener is called.
  static eprosima::fastdds::dds::StatusMask statuses() {
    auto mask = eprosima::fastdds::dds::StatusMask::liveliness_changed();
    return mask << eprosima::fastdds::dds::StatusMask::subscription_matched();
  }

  // Afterwards `waiting` is not used and may be destroyed.
  void close() {
    const std::lock_guard lock(mutex_);
    waiting_ = nullptr;
  }

  // Returns the writers lost since the last call; a writer may occur twice.
  std::vector<Handle> pop_lost() {
    const std::lock_guard lock(mutex_);
    return std::exchange(lost_, {});
  }

  // Called by threads of Fast DDS; only records the change.
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
