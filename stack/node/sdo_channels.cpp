// SPDX-License-Identifier: Apache-2.0
#include "stack/node/sdo_servers.h"

namespace linegate::node {

bool has_identifier(const od::Dictionary& dictionary, std::uint16_t first, std::uint16_t last,
                    od::Address place, can::CobId cob_id) {
  if (!cob_id.valid()) {
    return false;
  }
  for (std::uint32_t index = first; index <= last; ++index) {
    const auto raw = dictionary.number({static_cast<std::uint16_t>(index), place.sub});
    if (index == place.index || !raw) {
      continue;
    }
    const can::CobId other{static_cast<std::uint32_t>(*raw)};
    if (other.valid() && other.id() == cob_id.id() && other.extended() == cob_id.extended()) {
      return true;
    }
  }
  return false;
}

}  // namespace linegate::node
