// SPDX-License-Identifier: Apache-2.0
// The type support of a named topic that applications write (bridges/named): its samples are read
// by a plan, after DDS has delivered them, so no code is generated.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/utils/md5.h>

#include "bridges/dds/payload_handover.h"
#include "bridges/dds/received_type.h"
#include "bridges/named/set_plan.h"

namespace linegate::dds {

// A sample that was received: CDR with its encapsulation header.
struct NamedReceived {
  std::string topic;  // not set by DDS
  std::vector<std::byte> octets;
};

// For readers alone. Samples that are longer than max_size, or have no key, are discarded and
// counted; everything else is left to the plan. A sample that ends an instance has its key alone.
class NamedReadType final : public eprosima::fastdds::dds::TopicDataType {
 public:
  NamedReadType(const std::string& name, std::size_t max_size,
                std::shared_ptr<UnreadableCount> unreadable)
      : max_size_(max_size), unreadable_(std::move(unreadable)) {
    setName(name.c_str());
    m_typeSize = static_cast<std::uint32_t>(max_size);
    m_isGetKeyDefined = true;
  }

  bool serialize(void* /*data*/, eprosima::fastrtps::rtps::SerializedPayload_t*) override {
    return false;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* /*data*/) override {
    return [] { return 0U; };
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    auto& to = *static_cast<NamedReceived*>(data);
    const std::span<const std::byte> from{reinterpret_cast<const std::byte*>(payload->data),
                                          payload->length};
    const bool read = from.size() <= max_size_ && named::key_of_set(from).has_value();
    to.octets.clear();  // Fast DDS calls getKey() also if this fails
    if (read)
      to.octets.assign(from.begin(), from.end());
    payload_was_read(payload->data);
    if (!read)
      unreadable_->note(data);
    return read;
  }
  void* createData() override {
    auto* const object = new NamedReceived;
    unreadable_->library_has(object);
    return object;
  }
  void deleteData(void* object) override {
    unreadable_->library_had(object);
    delete static_cast<NamedReceived*>(object);
  }
  // It may have more than 16 octets, so its hash is always an MD5 (RTPS 2.3, 9.6.3.8).
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool /*force_md5*/ = false) override {
    const auto key = named::key_of_set(static_cast<const NamedReceived*>(data)->octets);
    if (!key)
      return false;
    std::array<char, named::SetKey::kMost> octets{};
    std::transform(key->octets.begin(), key->octets.end(), octets.begin(),
                   [](std::byte octet) { return std::to_integer<char>(octet); });
    MD5 md5;
    md5.init();
    md5.update(octets.data(), static_cast<MD5::size_type>(key->size));
    md5.finalize();
    for (std::uint8_t i = 0; i < 16; ++i)
      handle->value[i] = md5.digest[i];
    return true;
  }

 private:
  std::size_t max_size_;
  std::shared_ptr<UnreadableCount> unreadable_;
};

}  // namespace linegate::dds
