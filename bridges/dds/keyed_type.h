// SPDX-License-Identifier: Apache-2.0
// A generated type support whose key hash depends on the sample alone.
//
// The generated getKey() serializes the key into a buffer of the type support. Fast CDR skips the
// octets that align a member, and leaves there what an earlier key has written: before `group` of
// line "hall", an octet of a longer name of a line. One instance then has several key hashes: a
// writer cannot end it, a reader does not find the one that was ended, or has it twice. Besides,
// all threads of the library use that buffer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastrtps/utils/md5.h>

#include "stack/base/assert.h"

namespace linegate::dds {

template <class PubSubType>
class KeyedType : public PubSubType {
 public:
  using PubSubType::PubSubType;

  // Sets the handle to the key hash of the sample (RTPS 2.3, 9.6.3.8): of a key that may have more
  // than 16 octets the MD5 of its serialized form, whose padding is 0. From any thread.
  bool getKey(void* sample, eprosima::fastrtps::rtps::InstanceHandle_t* handle,
              bool force_md5 = false) override {
    using Sample = typename PubSubType::type;
    if (!this->m_isGetKeyDefined)
      return false;
    std::array<char, kLongestKey> key{};
    LINEGATE_ASSERT(Sample::getKeyMaxCdrSerializedSize() <= key.size(), "a key has room");
    eprosima::fastcdr::FastBuffer buffer(key.data(), key.size());
    eprosima::fastcdr::Cdr cdr(buffer, eprosima::fastcdr::Cdr::BIG_ENDIANNESS);
    static_cast<const Sample*>(sample)->serializeKey(cdr);
    if (force_md5 || Sample::getKeyMaxCdrSerializedSize() > kHash) {
      MD5 md5;
      md5.init();
      md5.update(key.data(), static_cast<MD5::size_type>(cdr.getSerializedDataLength()));
      md5.finalize();
      set(*handle, md5.digest);
    } else {
      set(*handle, key.data());
    }
    return true;
  }

 private:
  static constexpr std::size_t kHash = 16;         // octets
  static constexpr std::size_t kLongestKey = 256;  // octets; three names and their lengths

  template <class Octet>
  static void set(eprosima::fastrtps::rtps::InstanceHandle_t& handle, const Octet* hash) {
    for (std::uint8_t i = 0; i < kHash; ++i)
      handle.value[i] = static_cast<eprosima::fastrtps::rtps::octet>(hash[i]);
  }
};

}  // namespace linegate::dds
