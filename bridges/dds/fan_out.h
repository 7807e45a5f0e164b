// SPDX-License-Identifier: Apache-2.0
// The multicast group of process images: one datagram for all readers that announce it.
#pragma once

#include <cstdint>
#include <string_view>

#include <fastdds/rtps/common/Locator.h>

#include "bridges/dds/guard/announced_locators.h"

namespace linegate::dds {

// 239.255.76.71, port 7401 + 250 x domain: that of the user multicast of a domain (RTPS 2.3
// 9.6.1.1).
// USER_DATA of a writer that sends to the group (DDS 1.4 2.2.3.1): a reader cannot see it
// otherwise.
inline constexpr std::string_view kFanOutMark = "linegate.fan_out=multicast";

guard::MulticastGroup image_group(std::uint32_t domain);
eprosima::fastrtps::rtps::Locator_t locator_of(const guard::MulticastGroup& group);

}  // namespace linegate::dds
