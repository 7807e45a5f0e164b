// SPDX-License-Identifier: Apache-2.0
// Confines the locators of announcements if a participant accepts one multicast group. Pure
// functions without allocation.
//
// Fast DDS 2.9.1 opens the sending resources of a reader only for the locators that it has selected
// when the reader was matched. Of two readers with the same multicast locator it selects that one,
// and when one of them must be sent to alone, it selects its unicast locator, which is not open: an
// assertion ends the process (OutputTrafficManager.hpp:87). So no endpoint keeps locators of both
// kinds.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace linegate::dds::guard {

// The readers of `topic` may be sent to by multicast, to that group alone.
struct MulticastGroup {
  std::array<std::uint8_t, 4> address{};  // IPv4
  std::uint16_t port = 0;
  std::string_view topic;
};

enum class Announcer : std::uint8_t { reader, other };

// Turns parameters of a checked list, up to its sentinel, into padding (RTPS 2.3 9.6.2.2.1):
// - of a reader of the topic that announces the group: all its locators but the first of the group;
// - of everything else: all multicast locators.
// Unicast locators with a multicast address never remain.
void confine_locators(std::span<std::uint8_t> list, bool little, Announcer announcer,
                      const MulticastGroup& group);

}  // namespace linegate::dds::guard
