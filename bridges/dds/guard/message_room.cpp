// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/message_room.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include <dlfcn.h>
#include <fastdds/rtps/common/CDRMessage_t.h>
#include <fastdds/rtps/common/GuidPrefix_t.hpp>

#include "bridges/dds/guard/imports.h"

namespace linegate::dds::guard {
namespace {

using eprosima::fastrtps::rtps::CDRMessage_t;
using eprosima::fastrtps::rtps::GuidPrefix_t;
using Receivers = std::vector<GuidPrefix_t>;

// eprosima::fastrtps::rtps::security::SecurityManager::encode_rtps_message(const CDRMessage_t&,
// CDRMessage_t&, const std::vector<GuidPrefix_t>&) const. Its class has no public header.
constexpr const char* kEncode =
    "_ZNK8eprosima8fastrtps4rtps8security15SecurityManager19encode_rtps_message"
    "ERKNS1_12CDRMessage_tERS4_RKSt6vectorINS1_12GuidPrefix_tESaIS9_EE";
using Encode = bool(const void* manager, const CDRMessage_t& plain, CDRMessage_t& encrypted,
                    const Receivers& receivers);

Encode* library_encode() {
  static auto* const encode = reinterpret_cast<Encode*>(::dlsym(RTLD_DEFAULT, kEncode));
  return encode;
}

// Keeps what the message contains. It is unchanged if there is no memory.
void grow(CDRMessage_t& message, std::size_t size) {
  if (size <= message.max_size)
    return;
  auto* const octets = static_cast<eprosima::fastrtps::rtps::octet*>(std::malloc(size));
  if (octets == nullptr)
    return;
  std::copy_n(message.buffer, std::min(message.length, message.max_size), octets);
  if (!message.wraps)
    std::free(message.buffer);
  message.buffer = octets;  // the library frees it
  message.wraps = false;
  message.max_size = message.reserved_size = static_cast<std::uint32_t>(size);
}

bool encode_with_room(const void* manager, const CDRMessage_t& plain, CDRMessage_t& encrypted,
                      const Receivers& receivers) {
  if (receivers.empty())
    return true;  // its caller has written the header, and sends it to nobody
  grow(encrypted, room_for(plain.max_size, receivers.size()));
  return library_encode()(manager, plain, encrypted, receivers);
}

}  // namespace

bool make_room_for_protection() {
  static const bool replaced =
      library_encode() != nullptr &&
      replace_import("libfastrtps.so", kEncode, reinterpret_cast<void*>(encode_with_room));
  return replaced;
}

}  // namespace linegate::dds::guard
