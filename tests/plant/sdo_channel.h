// SPDX-License-Identifier: Apache-2.0
// Records of SDO channels that the EDS of a simulated device does not have.
#pragma once

#include <cstdint>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"

namespace linegate::plant {

// Adds a record of an SDO channel that is not valid: 1201h to 127Fh, 1280h to 12FFh.
inline void add_channel(od::Dictionary& to, std::uint16_t index) {
  od::ObjectDescription record{
      .index = index, .name = "SDO channel", .type = od::ObjectType::record};
  for (std::uint8_t sub = 0; sub <= 3; ++sub) {
    od::VariableDescription variable{.sub = sub, .type = od::DataType::unsigned8};
    variable.value = {std::byte{3}};
    if (sub == 1 || sub == 2) {
      variable.type = od::DataType::unsigned32;
      variable.value.resize(sizeof(std::uint32_t));
      store_le(std::span(variable.value), 0x8000'0000U);
    }
    if (sub == 3) {
      variable.value = {std::byte{0}};
    }
    variable.access = sub == 0 ? od::Access::constant : od::Access::rw;
    record.variables.push_back(variable);
  }
  ASSERT_TRUE(to.add(record).ok());
}

}  // namespace linegate::plant
