// SPDX-License-Identifier: Apache-2.0
// The type support of a named topic (bridges/named): its samples are written by a plan, before DDS
// has them, so no code is generated.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/utils/md5.h>

#include "bridges/dds/payload_handover.h"

namespace linegate::dds {

// A sample: CDR with its encapsulation header.
struct NamedData {
  std::span<const std::byte> octets;
};

// For writers alone.
class NamedType final : public eprosima::fastdds::dds::TopicDataType {
 public:
  // key: in CDR, big-endian; all samples have it, so its hash is made once. It may have more than
  // 16 octets, so its hash is always an MD5 (RTPS 2.3, 9.6.3.8). Empty: the topic has no key.
  NamedType(const std::string& name, std::size_t max_size, std::span<const std::byte> key) {
    setName(name.c_str());
    m_typeSize = static_cast<std::uint32_t>(max_size);
    m_isGetKeyDefined = !key.empty();
    std::string octets(reinterpret_cast<const char*>(key.data()), key.size());
    MD5 md5;
    md5.init();
    md5.update(octets.data(), static_cast<MD5::size_type>(octets.size()));
    md5.finalize();
    std::copy_n(md5.digest, key_.size(), key_.begin());
  }

  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const std::span<const std::byte> from = static_cast<const NamedData*>(data)->octets;
    payload_is_free(payload->data);
    if (from.size() > payload->max_size)
      return false;
    std::ranges::transform(from, payload->data,
                           [](std::byte octet) { return std::to_integer<std::uint8_t>(octet); });
    payload->length = static_cast<std::uint32_t>(from.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* /*payload*/,
                   void* /*data*/) override {
    return false;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    // The end of an instance has no octets, but a payload.
    return [data] {
      return static_cast<std::uint32_t>(
          std::max(kHeader, static_cast<const NamedData*>(data)->octets.size()));
    };
  }
  void* createData() override { return new NamedData; }
  void deleteData(void* data) override { delete static_cast<NamedData*>(data); }
  bool getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool /*force_md5*/ = false) override {
    if (!m_isGetKeyDefined)
      return false;
    for (std::size_t i = 0; i < key_.size(); ++i)
      handle->value[i] = key_[i];
    return true;
  }

 private:
  static constexpr std::size_t kHeader = 4;  // octets of an encapsulation

  std::array<std::uint8_t, 16> key_{};
};

}  // namespace linegate::dds
