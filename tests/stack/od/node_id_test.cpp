// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "stack/od/description.h"

namespace linegate::od {
namespace {

VariableDescription formula_value(std::initializer_list<int> bytes, bool formula) {
  VariableDescription out;
  for (const int byte : bytes) {
    out.value.push_back(static_cast<std::byte>(byte));
  }
  out.low_limit = out.high_limit = out.notes.default_value = out.value;
  out.notes.value_formula = formula;
  return out;
}

std::vector<std::byte> raw(std::initializer_list<int> numbers) {
  std::vector<std::byte> out;
  for (const int number : numbers) {
    out.push_back(static_cast<std::byte>(number));
  }
  return out;
}

TEST(NodeId, FormulasFollowItAndNothingElseDoes) {
  DeviceDescription device;
  device.node_id = 5;
  device.objects.push_back({.index = 0x1800,
                            .variables = {formula_value({0x85, 1, 0, 0x40}, true),
                                          formula_value({0x85, 1, 0, 0x40}, false)}});
  device.objects[0].variables[0].notes.high_formula = true;
  const DeviceDescription other = with_node_id(device, 127);
  EXPECT_EQ(other.node_id, 127);
  const auto& variables = other.objects[0].variables;
  EXPECT_EQ(variables[0].value, raw({0xFF, 1, 0, 0x40}));
  EXPECT_EQ(variables[0].high_limit, raw({0xFF, 1, 0, 0x40}));
  EXPECT_EQ(variables[0].low_limit, raw({0x85, 1, 0, 0x40}));
  EXPECT_EQ(variables[1].value, raw({0x85, 1, 0, 0x40}));
  EXPECT_EQ(with_node_id(other, 5), device) << "the reverse conversion";
}

}  // namespace
}  // namespace linegate::od
