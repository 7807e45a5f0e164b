// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_write_rule.h"

#include "stack/manager/pdo_check.h"
#include "stack/od/objects.h"

namespace linegate::line {

AbortCode PdoWriteRule::may_write(std::uint8_t node, od::Address address,
                                  std::span<const std::byte> value) const {
  if (!od::objects::is_pdo_record(address.index) || !manager_.active()) {
    return AbortCode::none;
  }
  const char boot = manager_.node(node).boot;
  const bool has_pdos = manager::is_booted(boot) || boot == manager::kBootUnfinished;
  return has_pdos && manager::changes_pdo(configurator_.objects().pdos(node), address, value)
             ? AbortCode::device_state
             : AbortCode::none;
}

}  // namespace linegate::line
