// SPDX-License-Identifier: Apache-2.0
// The multicast group of process images: one datagram for all readers that announce it.
#pragma once

#include <cstdint>

#include <fastdds/rtps/common/Locator.h>

#include "bridges/dds/guard/announced_locators.h"

namespace linegate::dds {

// 239.255.76.71, port 7401 + 250 x domain: that of the user multicast of a domain (RTPS 2.3
// 9.6.1.1).
guard::MulticastGroup image_group(std::uint32_t domain);
eprosima::fastrtps::rtps::Locator_t locator_of(const guard::MulticastGroup& group);

}  // namespace linegate::dds
