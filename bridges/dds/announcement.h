// SPDX-License-Identifier: Apache-2.0
// Announcements of participants (SPDP, RTPS 2.3 8.5.3 and 9.6.1.4) as datagrams. Pure functions.
//
// A participant of Fast DDS sees one domain only. These see each datagram, whatever its domain.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bridges/dds/observed.h"

namespace linegate::dds {

// Ports of RTPS 2.3 9.6.1.1 with its default parameters. domain <= 232.
constexpr std::uint16_t multicast_port(std::uint32_t domain) {
  return static_cast<std::uint16_t>(7400 + 250 * domain);
}
// participant: its number on its host, < 120.
constexpr std::uint16_t unicast_port(std::uint32_t domain, std::uint32_t participant) {
  return static_cast<std::uint16_t>(7400 + 250 * domain + 10 + 2 * participant);
}

// The announcement in a datagram; nothing if it has none, or is malformed.
std::optional<Announcement> read_announcement(std::span<const std::uint8_t> datagram);

// A datagram that announces a participant without endpoints, which a participant answers with its
// own announcement. `announcement` has one locator. lease: in s. With leaving: its end.
std::vector<std::uint8_t> write_announcement(const Announcement& announcement, std::uint32_t lease);

}  // namespace linegate::dds
