// SPDX-License-Identifier: Apache-2.0
// The type of a named topic for its description over DDS, from which generic tools learn the names
// of its members. Fast DDS 2.9 leaves members that are structs out of a description, so this one is
// flat: a struct with the same octets, without a struct in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bridges/named/device_types.h"

namespace linegate::named {

struct DescribedMember {
  std::string name;  // "gateway", "values_Speed", "received_pdo1"
  Form form = Form::uint8;
  std::uint16_t length = 0;  // as that of Member

  friend bool operator==(const DescribedMember&, const DescribedMember&) = default;
};

// In the order of the sample.
std::vector<DescribedMember> described_members(const DeviceType& type);

// An announcement with a longer description would not fit into one datagram, and then not be
// accepted by Linegate's own programs.
inline constexpr std::size_t kLongestDescription = 40'000;
// The octets of the description in an announcement, at most.
std::size_t description_size(const std::vector<DescribedMember>& members);
bool can_be_described(const DeviceType& type);

}  // namespace linegate::named
