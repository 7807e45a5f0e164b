// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/announced_locators.h"

#include <algorithm>
#include <cstddef>

#include "bridges/dds/guard/parameters.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {
namespace {

constexpr std::size_t kLocator = 24;  // kind, port, address (RTPS 2.3 9.3.2.5)
constexpr std::uint32_t kUdpV4 = 1;
constexpr std::uint32_t kUdpV6 = 2;
constexpr std::uint16_t kTopicName = 0x0005;

bool is_unicast_locator(std::uint16_t id) {
  switch (id) {
    case 0x000C:  // default unicast IP address
    case 0x002F:  // unicast locator
    case 0x0031:  // default unicast locator
    case 0x0032:  // metatraffic unicast locator
      return true;
    default:
      return false;
  }
}

bool is_multicast_locator(std::uint16_t id) {
  switch (id) {
    case 0x000B:  // metatraffic multicast IP address
    case 0x0011:  // multicast IP address
    case 0x0030:  // multicast locator
    case 0x0033:  // metatraffic multicast locator
    case 0x0048:  // default multicast locator
      return true;
    default:
      return false;
  }
}

bool is_group_address(const Wire& locator) {
  if (locator.size() == 4)  // an IP address
    return (locator.u8(0) & 0xF0U) == 0xE0;
  if (locator.size() < kLocator)
    return false;
  const std::uint32_t kind = locator.u32(0);
  return kind == kUdpV6 ? locator.u8(8) == 0xFF : (locator.u8(20) & 0xF0U) == 0xE0;
}

bool names(const Wire& locator, const MulticastGroup& group) {
  const Octets address = locator.octets().subspan(8, 16);
  return locator.u32(0) == kUdpV4 && locator.u32(4) == group.port &&
         std::ranges::all_of(address.first(12), [](std::uint8_t octet) { return octet == 0; }) &&
         std::ranges::equal(address.subspan(12), group.address);
}

// The CDR string with its terminating NUL.
bool is_text(const Wire& value, std::string_view text) {
  const std::size_t length = value.u32(0);
  if (length != text.size() + 1)
    return false;
  return std::ranges::equal(
      value.octets().subspan(4, text.size()), text,
      [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
}

constexpr std::size_t kNone = SIZE_MAX;

// The position of the locator that a reader keeps. Fast DDS takes the last of several names.
std::size_t kept_locator(const Wire& list, const MulticastGroup& group) {
  constexpr std::uint16_t kMulticastLocator = 0x0030;
  bool of_topic = false;
  bool of_others = false;
  std::size_t kept = kNone;
  each_parameter(list, [&](std::size_t at, std::uint16_t id, const Wire& value) {
    if (id == kTopicName)
      (is_text(value, group.topic) ? of_topic : of_others) = true;
    if (id == kMulticastLocator && kept == kNone && names(value, group))
      kept = at;
  });
  return of_topic && !of_others ? kept : kNone;
}

}  // namespace

void confine_locators(std::span<std::uint8_t> list, bool little, Announcer announcer,
                      const MulticastGroup& group) {
  const Wire wire(list, little);
  const std::size_t kept = announcer == Announcer::reader ? kept_locator(wire, group) : kNone;
  each_parameter(wire, [&](std::size_t at, std::uint16_t id, const Wire& value) {
    const bool drop = is_multicast_locator(id)
                          ? at != kept
                          : is_unicast_locator(id) && (kept != kNone || is_group_address(value));
    if (drop)
      list[at] = list[at + 1] = 0;
  });
}

}  // namespace linegate::dds::guard
