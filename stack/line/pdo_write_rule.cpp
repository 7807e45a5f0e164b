// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_write_rule.h"

#include "stack/manager/pdo_check.h"
#include "stack/od/objects.h"

namespace linegate::line {

AbortCode PdoWriteRule::may_write(std::uint8_t node, od::Address address,
                                  std::span<const std::byte> value) const {
  const bool is_refused = od::objects::is_pdo_record(address.index) && manager_.active() &&
                          manager_.keeps_pdos(node) &&
                          manager::changes_pdo(configurator_.objects().pdos(node), address, value);
  return is_refused ? AbortCode::device_state : AbortCode::none;
}

}  // namespace linegate::line
