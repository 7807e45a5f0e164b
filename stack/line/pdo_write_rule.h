// SPDX-License-Identifier: Apache-2.0
// Keeps the PDOs of booted nodes as the process image has them: their COB-IDs and mappings, and the
// transmission types of RPDOs, are written by the configuration of the node alone; no TPDO gets a
// transmission type with which it is no longer sent; and no other service of a node is moved to the
// COB-ID of a PDO of the image, or any service to one of an SDO connection. Private to stack/line.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/time.h"
#include "stack/line/config.h"
#include "stack/manager/configurator.h"
#include "stack/manager/manager.h"
#include "stack/node/node.h"
#include "stack/sdo/write_rule.h"

namespace linegate::line {

class PdoWriteRule final : public sdo::WriteRule {
 public:
  // All must outlive it.
  PdoWriteRule(const LineConfig& config, const node::Node& node, const manager::Manager& manager,
               const manager::Configurator& configurator)
      : config_(config), node_(node), manager_(manager), configurator_(configurator) {}

  // device_state if the write would change a PDO of the image, and no boot process follows that
  // compares it (Manager::keeps_pdos()), or the identifiers or the mapping of an SRDO of the image.
  // invalid_value if it would set 1005h or 1014h of a node to the COB-ID of a PDO of the image, or
  // a COB-ID of any service to one of LineConfig::connection_pool.
  AbortCode may_write(std::uint8_t node, od::Address address, std::span<const std::byte> value,
                      Instant now) const override;

  // Call it with each SYNC that the own node processes, also those that it sends.
  void synced(Instant now) { synced_at_ = now; }

 private:
  bool changes_image(std::uint8_t node, od::Address address, std::span<const std::byte> value,
                     Instant now) const;
  bool has_sync(Instant now) const;
  bool changes_srdo(std::uint8_t node, od::Address address, std::span<const std::byte> value) const;
  bool takes_cob_id(od::Address address, std::span<const std::byte> value) const;
  bool takes_connection_id(od::Address address, std::span<const std::byte> value) const;

  const LineConfig& config_;
  const node::Node& node_;
  const manager::Manager& manager_;
  const manager::Configurator& configurator_;
  std::optional<Instant> synced_at_{};  // the last SYNC
};

}  // namespace linegate::line
