// SPDX-License-Identifier: Apache-2.0
// Devices described by hand for tests of PDOs.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::pdo::test {

using od::Access;
using od::DataType;

// A generator with the same numbers on every machine.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }
  // Bytes for a frame or an area.
  template <class Bytes>
  void fill(Bytes& bytes) {
    for (std::byte& b : bytes) {
      b = static_cast<std::byte>((*this)());
    }
  }

 private:
  std::mt19937 engine_;
};

inline Instant at(std::int64_t ms) {
  return Instant(std::chrono::milliseconds(ms));
}

inline od::VariableDescription variable(std::uint8_t sub, DataType type, Access access,
                                        std::uint64_t value = 0, bool mappable = false) {
  od::VariableDescription out;
  out.sub = sub;
  out.name = "Sub " + std::to_string(sub);
  out.type = type;
  out.access = access;
  out.mappable = mappable;
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

// A mappable variable.
inline od::ObjectDescription value(std::uint16_t index, DataType type, Access access = Access::rw,
                                   std::uint64_t initial = 0) {
  od::ObjectDescription out;
  out.index = index;
  out.name = "Value";
  out.variables = {variable(0, type, access, initial, true)};
  return out;
}

struct Pdo {
  std::uint16_t number = 1;
  std::uint32_t cob_id = 0;
  std::uint8_t type = 255;
  std::uint16_t inhibit = 0;      // 100 us
  std::uint16_t event_timer = 0;  // ms
  std::uint8_t sync_start = 0;
  std::vector<std::uint32_t> mapping;  // raw entries
  std::uint8_t room = 8;               // sub-indices of the mapping record
};

inline void add_pdo(od::DeviceDescription& device, std::uint16_t base, const Pdo& pdo) {
  od::ObjectDescription communication;
  communication.index = static_cast<std::uint16_t>(base + pdo.number - 1);
  communication.name = "Communication";
  communication.type = od::ObjectType::record;
  communication.line = 100U + communication.index;
  communication.variables = {
      variable(0, DataType::unsigned8, Access::constant, 6),
      variable(1, DataType::unsigned32, Access::rw, pdo.cob_id),
      variable(2, DataType::unsigned8, Access::rw, pdo.type),
      variable(3, DataType::unsigned16, Access::rw, pdo.inhibit),
      variable(5, DataType::unsigned16, Access::rw, pdo.event_timer),
      variable(6, DataType::unsigned8, Access::rw, pdo.sync_start),
  };
  od::ObjectDescription mapping;
  mapping.index = static_cast<std::uint16_t>(base + 0x200 + pdo.number - 1);
  mapping.name = "Mapping";
  mapping.type = od::ObjectType::record;
  mapping.line = 100U + mapping.index;
  mapping.variables = {variable(0, DataType::unsigned8, Access::rw, pdo.mapping.size())};
  for (std::uint8_t i = 0; i < pdo.room || i < pdo.mapping.size(); ++i) {
    const std::uint32_t raw = i < pdo.mapping.size() ? pdo.mapping[i] : 0;
    mapping.variables.push_back(
        variable(static_cast<std::uint8_t>(i + 1), DataType::unsigned32, Access::rw, raw));
  }
  device.objects.push_back(communication);
  device.objects.push_back(mapping);
}

inline void add_rpdo(od::DeviceDescription& device, const Pdo& pdo) {
  add_pdo(device, 0x1400, pdo);
}
inline void add_tpdo(od::DeviceDescription& device, const Pdo& pdo) {
  add_pdo(device, 0x1800, pdo);
}

// The objects of a dictionary must be ascending.
inline od::DeviceDescription sorted(od::DeviceDescription device) {
  std::sort(device.objects.begin(), device.objects.end(),
            [](const auto& a, const auto& b) { return a.index < b.index; });
  return device;
}

inline can::Frame frame(std::uint32_t id, std::initializer_list<std::uint8_t> data, Instant time) {
  can::Frame out = can::make_frame(id, data);
  out.time = time;
  return out;
}

inline std::vector<unsigned> data_of(const can::Frame& frame) {
  std::vector<unsigned> out;
  for (const std::byte b : frame.bytes()) {
    out.push_back(std::to_integer<unsigned>(b));
  }
  return out;
}

}  // namespace linegate::pdo::test
