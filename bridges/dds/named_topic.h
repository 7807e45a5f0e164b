// SPDX-License-Identifier: Apache-2.0
// A named topic (bridges/named), as its writer has to know it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bridges/named/described_type.h"

namespace linegate::dds {

struct NamedTopic {
  std::string line;
  std::string topic;
  std::string type;
  std::size_t max_size = 0;                       // of a sample, in octets
  std::vector<std::byte> key;                     // see NamedType; empty: the topic has no key
  std::vector<named::DescribedMember> members{};  // none: the type is not described over DDS
};

}  // namespace linegate::dds
