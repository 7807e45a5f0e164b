// SPDX-License-Identifier: Apache-2.0
// The type support of a reader: a malformed sample is discarded and counted, without further
// effect.
//
// Fast CDR throws if a boolean is neither true nor false, or an encapsulation is unknown. Neither
// the generated types nor Fast DDS catch the exception, in threads of the library as well as in the
// caller's: a single octet from an untrusted host would end the process.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

#include <fastdds/dds/topic/TypeSupport.hpp>

#include "bridges/dds/keyed_type.h"
#include "bridges/dds/payload_handover.h"

namespace linegate::dds {

// Counts samples of any type that could not be deserialized.
class UnreadableCount {
 public:
  // Returns their number since the last call.
  std::uint64_t take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(count_, 0);
  }

  // A sample could not be deserialized into `object`. Fast DDS deserializes a sample twice if it
  // arrived without key hash: first into an object of the library, which is not counted.
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
class ReceivedType : public KeyedType<PubSubType> {
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
  // The type of a topic has writers, too (written_type.h).
  bool serialize(void* sample, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    payload_is_free(payload->data);
    return PubSubType::serialize(sample, payload);
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
