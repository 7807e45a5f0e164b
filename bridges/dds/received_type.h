// SPDX-License-Identifier: Apache-2.0
// A type as a reader has it: a damaged sample cannot be read, which is counted, and nothing else
// happens.
//
// Fast CDR throws when a boolean is neither true nor false, or an encapsulation unknown. Neither
// the generated types nor Fast DDS catch it, in threads of the library as well as in the caller's:
// a stranger's octet would end the process.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include <fastdds/dds/topic/TypeSupport.hpp>

#include "bridges/dds/payload_handover.h"

namespace linegate::dds {

// Samples of any type that could not be read.
class UnreadableCount {
 public:
  // Those since the last call.
  std::uint64_t take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(count_, 0);
  }

  // A sample could not be read into `object`. Fast DDS reads each sample twice when it came without
  // a hash of its key: first into an object of its own, which does not count.
  void note(const void* object) {
    const std::lock_guard lock(mutex_);
    count_ += library_objects_.contains(object) ? 0U : 1U;
  }
  void library_has(const void* object) {
    const std::lock_guard lock(mutex_);
    library_objects_.insert(object);
  }
  void library_had(const void* object) {
    const std::lock_guard lock(mutex_);
    library_objects_.erase(object);
  }

 private:
  std::mutex mutex_;
  std::uint64_t count_ = 0;
  std::set<const void*> library_objects_;
};

template <class PubSubType>
class ReceivedType : public PubSubType {
 public:
  explicit ReceivedType(std::shared_ptr<UnreadableCount> unreadable)
      : unreadable_(std::move(unreadable)) {}

  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    const bool read = try_deserialize(payload, data);
    payload_was_read(payload->data);
    if (!read)
      unreadable_->note(data);
    return read;
  }
  void* createData() override {
    void* object = PubSubType::createData();
    unreadable_->library_has(object);
    return object;
  }
  void deleteData(void* object) override {
    unreadable_->library_had(object);
    PubSubType::deleteData(object);
  }

 private:
  bool try_deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) {
    try {
      return PubSubType::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }

  std::shared_ptr<UnreadableCount> unreadable_;
};

}  // namespace linegate::dds
