// SPDX-License-Identifier: Apache-2.0
// Room for what DDS-Security adds to an RTPS message.
//
// Fast DDS 2.9.1 fills a message with as many submessages as its buffer holds, then encrypts it
// into a buffer of the same size (RTPSMessageGroup.cpp, "Control message size if it will be
// encrypted"). Where the encrypted message is too long, the library does not send it, and makes it
// again as long when a reader requests it; where only its statistics submessage has no place, it
// ends the process. It also ends the process if the last reader of a message leaves before it is
// encrypted (SecurityManager.cpp:2272). So it depended on luck whether a gateway outlived a reader
// for which more than 64 KiB of samples wait.
#pragma once

#include <cstddef>
#include <cstdint>

namespace linegate::dds::guard {

// The octets by which messages of a participant with protection are shorter than its transports
// permit, before they are encrypted. DDS-Security 1.1 9.5.2.1 to 9.5.2.5: prefix, header, body and
// common MAC need 72, the statistics submessage 48; with *_WITH_ORIGIN_AUTHENTICATION each
// receiver needs 20 more.
inline constexpr std::uint32_t kProtectionRoom = 512;

// From now on the library encrypts each message of this process into a buffer that is long enough,
// and none without receivers. Returns false if its call cannot be replaced.
bool make_room_for_protection();

// The octets of a buffer for a message of `plain` octets that is encrypted for that many receivers.
constexpr std::size_t room_for(std::size_t plain, std::size_t receivers) {
  return plain + kProtectionRoom + 20 * receivers;
}

}  // namespace linegate::dds::guard
