// SPDX-License-Identifier: Apache-2.0
#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::od {
namespace {

void shift(std::vector<std::byte>& value, bool formula, std::uint64_t by) {
  if (formula && value.size() <= sizeof by) {
    store_le(std::span(value), load_le(std::span<const std::byte>(value)) + by);
  }
}

}  // namespace

DeviceDescription with_node_id(DeviceDescription device, std::uint8_t node_id) {
  const std::uint64_t by = std::uint64_t{node_id} - device.node_id;
  for (ObjectDescription& object : device.objects) {
    for (VariableDescription& variable : object.variables) {
      shift(variable.value, variable.notes.value_formula, by);
      shift(variable.low_limit, variable.notes.low_formula, by);
      shift(variable.high_limit, variable.notes.high_formula, by);
      shift(variable.notes.default_value, variable.notes.default_formula, by);
    }
  }
  device.node_id = node_id;
  return device;
}

}  // namespace linegate::od
