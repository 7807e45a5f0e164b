// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_write_rule.h"

#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/image/layout.h"
#include "stack/line/srdo_plan.h"
#include "stack/manager/pdo_check.h"
#include "stack/od/objects.h"
#include "stack/srdo/parameters.h"
#include "stack/sync/parameters.h"

namespace linegate::line {
namespace {

// Without a communication cycle period: SYNC that was not received for this long has ended.
constexpr Duration kSyncEnds = std::chrono::seconds(10);

// The PDO that is not in the image has CobIds of those that are (AssumedPdo::taken).
bool has_cob_id(const manager::AssumedPdo& pdo, can::CobId cob_id) {
  return pdo.taken == nullptr &&
         std::ranges::any_of(pdo.parameters, [cob_id](const manager::ObjectWrite& parameter) {
           if (!od::objects::is_pdo_communication(parameter.address.index) ||
               parameter.address.sub != 1 || parameter.data.size() != sizeof cob_id.raw) {
             return false;
           }
           const can::CobId of_pdo{load_le<std::uint32_t>(parameter.data.data())};
           return of_pdo.valid() && of_pdo.id() == cob_id.id() &&
                  of_pdo.extended() == cob_id.extended();
         });
}

// Objects that hold the COB-ID of a service (CiA 301).
bool holds_cob_id(od::Address address) {
  using namespace od::objects;
  const bool of_variable =
      address.sub == 0 &&
      (address.index == kSyncCobId || address.index == kTimeCobId || address.index == kEmcyCobId);
  const bool of_sdo = address.index >= kSdoServer && address.index <= kLastSdoClient &&
                      (address.sub == 1 || address.sub == 2);
  return of_variable || of_sdo || (is_pdo_communication(address.index) && address.sub == 1);
}

// In these bit 31 has another meaning, or none.
bool ignores_bit31(std::uint16_t index) {
  return index == od::objects::kSyncCobId || index == od::objects::kTimeCobId;
}

}  // namespace

AbortCode PdoWriteRule::may_write(std::uint8_t node, od::Address address,
                                  std::span<const std::byte> value, Instant now) const {
  const bool is_refused = od::objects::is_pdo_record(address.index) && manager_.active() &&
                          manager_.keeps_pdos(node) && changes_image(node, address, value, now);
  if (is_refused) {
    return AbortCode::device_state;
  }
  if (manager_.active() && changes_srdo(node, address, value)) {
    return AbortCode::device_state;
  }
  const bool takes =
      manager_.active() && (takes_cob_id(address, value) || takes_connection_id(address, value));
  return takes ? AbortCode::invalid_value : AbortCode::none;
}

// The pool of SDO connections is of the manager alone.
bool PdoWriteRule::takes_connection_id(od::Address address,
                                       std::span<const std::byte> value) const {
  if (!holds_cob_id(address) || value.size() != sizeof(std::uint32_t)) {
    return false;
  }
  const can::CobId cob_id{load_le<std::uint32_t>(value.data())};
  const bool exists = cob_id.valid() || ignores_bit31(address.index);
  return exists && !cob_id.extended() && config_.connection_pool.has(cob_id.id());
}

bool PdoWriteRule::changes_image(std::uint8_t node, od::Address address,
                                 std::span<const std::byte> value, Instant now) const {
  const std::span<const manager::AssumedPdo> pdos = configurator_.objects().pdos(node);
  return manager::changes_pdo(pdos, address, value) ||
         manager::ends_transmission(pdos, address, value, has_sync(now));
}

// The own node sends SYNC, or received one within 1.5 periods of 1006h, as sync::Consumer monitors
// it.
bool PdoWriteRule::has_sync(Instant now) const {
  const sync::Parameters own = sync::read_parameters(node_.dictionary());
  const bool is_periodic = own.period > Duration::zero();
  if (own.is_producer() && is_periodic) {
    return true;
  }
  const Duration most = is_periodic ? own.period + own.period / 2 : kSyncEnds;
  return synced_at_ && now - *synced_at_ <= most;
}

// An SRDO that is switched off, or maps nothing, becomes unsafe; with other identifiers or objects
// its values would be shown at the wrong place.
bool PdoWriteRule::changes_srdo(std::uint8_t node, od::Address address,
                                std::span<const std::byte> value) const {
  const std::uint8_t number = srdo::number_of(address.index);
  const auto found = std::ranges::find(config_.nodes, node, &NodeConfig::id);
  if (number == 0 || found == config_.nodes.end()) {
    return false;
  }
  const bool mapping = address.index == srdo::mapping_record(number);
  const bool matters = mapping ? load_le(value.first(std::min<std::size_t>(value.size(), 8))) != 0
                               : address.sub == srdo::kCobId || address.sub == srdo::kInvertedCobId;
  const od::VariableDescription* const described = found->device.find(address);
  if (!matters || (described != nullptr && std::ranges::equal(described->value, value))) {
    return false;
  }
  const std::vector<pdo::Parameters> shown = transmitted_srdos(*found);
  return std::ranges::find(shown, image::kFirstSrdo + number - 1, &pdo::Parameters::number) !=
         shown.end();
}

// Bit 31 of 1005h has no meaning (CiA 301 7.5.2.5); of 1014h it is set if there is no EMCY.
bool PdoWriteRule::takes_cob_id(od::Address address, std::span<const std::byte> value) const {
  const bool is_sync = address == od::Address{od::objects::kSyncCobId, 0};
  can::CobId cob_id{};
  if ((!is_sync && address != od::Address{od::objects::kEmcyCobId, 0}) ||
      value.size() != sizeof cob_id.raw) {
    return false;
  }
  cob_id.raw = load_le<std::uint32_t>(value.data());
  if (!is_sync && !cob_id.valid()) {
    return false;
  }
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (std::ranges::any_of(configurator_.objects().pdos(node),
                            [cob_id](const auto& pdo) { return has_cob_id(pdo, cob_id); })) {
      return true;
    }
  }
  return false;
}

}  // namespace linegate::line
