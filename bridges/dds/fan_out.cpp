// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/fan_out.h"

#include <fastrtps/utils/IPLocator.h>
#include <linegate.h>

namespace linegate::dds {

guard::MulticastGroup image_group(std::uint32_t domain) {
  return {
      {239, 255, 76, 71}, static_cast<std::uint16_t>(7401 + 250 * domain), v1::TOPIC_PROCESS_IMAGE};
}

eprosima::fastrtps::rtps::Locator_t locator_of(const guard::MulticastGroup& group) {
  eprosima::fastrtps::rtps::Locator_t out;
  out.kind = LOCATOR_KIND_UDPv4;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(out, group.address.data());
  eprosima::fastrtps::rtps::IPLocator::setPhysicalPort(out, group.port);
  return out;
}

}  // namespace linegate::dds
