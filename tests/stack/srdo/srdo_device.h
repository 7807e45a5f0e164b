// SPDX-License-Identifier: Apache-2.0
// A device with SRDO 1 that it transmits, as a device file describes it.
#pragma once

#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::srdo {

inline od::VariableDescription srdo_variable(std::uint8_t sub, od::DataType type,
                                             std::uint64_t value) {
  od::VariableDescription out{.sub = sub, .name = {}, .type = type, .mappable = true};
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

// Node 1: the example with the signature 51AFh. 13FEh and 13FFh are as in a new device.
inline od::DeviceDescription srdo_device() {
  using od::DataType;
  const auto object = [](std::uint16_t index, std::vector<od::VariableDescription> variables) {
    return od::ObjectDescription{.index = index, .name = {}, .variables = std::move(variables)};
  };
  const auto u8 = [](std::uint8_t sub, std::uint64_t value) {
    return srdo_variable(sub, DataType::unsigned8, value);
  };
  const auto u16 = [](std::uint8_t sub, std::uint64_t value) {
    return srdo_variable(sub, DataType::unsigned16, value);
  };
  const auto u32 = [](std::uint8_t sub, std::uint64_t value) {
    return srdo_variable(sub, DataType::unsigned32, value);
  };
  od::DeviceDescription out;
  out.file = "safe.eds";
  out.node_id = 1;
  out.objects = {object(0x1000, {u32(0, 0)}),
                 object(0x1300, {u8(0, 0)}),
                 object(0x1301, {u8(0, 6), u8(1, 1), u16(2, 25), u8(3, 20), u8(4, 254),
                                 u32(5, 0x101), u32(6, 0x102)}),
                 object(0x1381, {u8(0, 2), u32(1, 0x2000'0108), u32(2, 0x2000'0208)}),
                 object(0x13FE, {u8(0, 0)}),
                 object(0x13FF, {u8(0, 1), u16(1, 0)}),
                 object(0x2000, {u8(0, 2), u8(1, 0), u8(2, 0)})};
  return out;
}

}  // namespace linegate::srdo
