// SPDX-License-Identifier: Apache-2.0
// Reports that a reader was matched with a writer, or has left.
#pragma once

#include <functional>
#include <mutex>
#include <utility>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>

namespace linegate::dds {

// The listener of any number of writers.
class ReaderWatch final : public eprosima::fastdds::dds::DataWriterListener {
 public:
  // The statuses for which the listener is called.
  static eprosima::fastdds::dds::StatusMask statuses() {
    return eprosima::fastdds::dds::StatusMask::publication_matched();
  }

  // changed: called in threads of Fast DDS; it must not block, nor use DDS. Afterwards the function
  // before it is not called any more.
  void call(std::function<void()> changed) {
    const std::lock_guard lock(mutex_);
    changed_ = std::move(changed);
  }

  void on_publication_matched(
      eprosima::fastdds::dds::DataWriter*,
      const eprosima::fastdds::dds::PublicationMatchedStatus& /*status*/) override {
    const std::lock_guard lock(mutex_);
    if (changed_)
      changed_();
  }

 private:
  std::mutex mutex_;
  std::function<void()> changed_;
};

}  // namespace linegate::dds
