// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "stack/manager/network_list.h"
#include "stack/od/objects.h"

namespace linegate::manager {

od::ObjectDescription node_array(std::uint16_t index, od::Access access, std::uint8_t last) {
  const od::objects::Entry& entry = od::objects::at(index);
  od::ObjectDescription out{
      .index = index, .name = std::string(entry.name), .type = od::ObjectType::array};
  out.variables.push_back({.sub = 0,
                           .name = "Highest sub-index supported",
                           .type = od::DataType::unsigned8,
                           .access = od::Access::constant,
                           .value = {std::byte{last}}});
  for (unsigned sub = 1; sub <= last; ++sub) {
    const std::string of = sub == kAllNodes ? "all nodes" : "node " + std::to_string(sub);
    out.variables.push_back({.sub = static_cast<std::uint8_t>(sub),
                             .name = out.name + ", " + of,
                             .type = entry.type,
                             .access = access,
                             .value = std::vector<std::byte>(od::byte_size(entry.type))});
  }
  return out;
}

}  // namespace linegate::manager
