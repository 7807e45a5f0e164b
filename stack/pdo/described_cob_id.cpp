// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/described_cob_id.h"

#include <algorithm>

#include "stack/base/byte_order.h"

namespace linegate::pdo {
namespace {

constexpr std::uint16_t kPredefinedPdos = 4;  // of each kind, CiA 301 7.3.5

bool has_node_id(const od::DeviceDescription& device) {
  return device.node_id >= can::kMinNodeId && device.node_id <= can::kMaxNodeId;
}

}  // namespace

can::CobId described_cob_id(const od::DeviceDescription& device, PdoKind kind,
                            std::uint16_t number) {
  const auto record = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
  const od::VariableDescription* variable = device.find(od::Address{record, 1});
  if (variable == nullptr || variable->value.size() > sizeof(std::uint64_t)) {
    return {};
  }
  const auto raw = static_cast<std::uint32_t>(load_le(std::span<const std::byte>(variable->value)));
  const can::CobId said{raw};
  if (!said.valid() || said.id() != 0 || said.extended()) {
    return said;
  }
  if (number > kPredefinedPdos || !has_node_id(device)) {
    return {raw | can::CobId::kInvalidBit};
  }
  return {raw | (kind == PdoKind::tpdo ? can::default_tpdo_id(number, device.node_id)
                                       : can::default_rpdo_id(number, device.node_id))};
}

void complete_cob_ids(od::DeviceDescription& device) {
  for (const PdoKind kind : {PdoKind::rpdo, PdoKind::tpdo}) {
    for (std::uint16_t number = 1; number <= kPredefinedPdos; ++number) {
      const auto record = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
      const can::CobId cob_id = described_cob_id(device, kind, number);
      const auto object = std::ranges::find(device.objects, record, &od::ObjectDescription::index);
      if (object == device.objects.end()) {
        continue;
      }
      const auto variable =
          std::ranges::find(object->variables, std::uint8_t{1}, &od::VariableDescription::sub);
      if (variable == object->variables.end() ||
          load_le(std::span<const std::byte>(variable->value)) == cob_id.raw) {
        continue;
      }
      variable->value.resize(sizeof cob_id.raw);
      store_le(std::span(variable->value), cob_id.raw);
      variable->notes.value_formula = cob_id.valid();
    }
  }
}

}  // namespace linegate::pdo
