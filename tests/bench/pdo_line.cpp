// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/pdo_line.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <numeric>
#include <random>
#include <string>

#include "stack/base/byte_order.h"

namespace linegate::bench {
namespace {

constexpr std::uint16_t kSource = 0x6000;
constexpr std::size_t kPdosPerNode = 8;
// Longer than the longest interval between two frames of one PDO when 512 PDOs share a full bus.
constexpr Duration kDeadline = std::chrono::seconds(5);

od::VariableDescription variable(std::size_t sub, od::DataType type, std::uint32_t value) {
  od::VariableDescription out{.sub = static_cast<std::uint8_t>(sub),
                              .name = "Value " + std::to_string(sub),
                              .type = type,
                              .access = od::Access::ro};
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), std::uint64_t{value});
  return out;
}

od::ObjectDescription object(std::size_t index, od::ObjectType type) {
  return {.index = static_cast<std::uint16_t>(index), .name = "Object", .type = type};
}

od::ObjectDescription values(std::size_t count, od::DataType type) {
  od::ObjectDescription out = object(kSource, od::ObjectType::array);
  out.variables.push_back(variable(0, od::DataType::unsigned8, static_cast<std::uint32_t>(count)));
  for (std::size_t sub = 1; sub <= count; ++sub) {
    out.variables.push_back(variable(sub, type, 0));
    out.variables.back().mappable = true;
  }
  return out;
}

od::ObjectDescription communication(std::size_t pdo, std::uint32_t id, std::uint32_t type) {
  od::ObjectDescription out = object(0x1800 + pdo, od::ObjectType::record);
  out.variables = {variable(0, od::DataType::unsigned8, 2),
                   variable(1, od::DataType::unsigned32, id),
                   variable(2, od::DataType::unsigned8, type)};
  return out;
}

od::ObjectDescription mapping_of(std::size_t pdo, std::size_t count, std::size_t bits) {
  od::ObjectDescription out = object(0x1A00 + pdo, od::ObjectType::record);
  out.variables.push_back(variable(0, od::DataType::unsigned8, static_cast<std::uint32_t>(count)));
  for (std::size_t sub = 1; sub <= count; ++sub) {
    const auto mapped = static_cast<std::uint32_t>(std::size_t{kSource} << 16U | sub << 8U | bits);
    out.variables.push_back(variable(sub, od::DataType::unsigned32, mapped));
  }
  return out;
}

od::DeviceDescription device(Mapping mapping, std::span<const std::uint32_t> ids) {
  const bool bits = mapping == Mapping::bits;
  const std::size_t count = bits ? 64 : 4;
  od::DeviceDescription out;
  out.file = "bench.eds";
  for (std::size_t pdo = 0; pdo < ids.size(); ++pdo) {
    out.objects.push_back(
        communication(pdo, ids[pdo], mapping == Mapping::synchronous ? 1U : 255U));
  }
  for (std::size_t pdo = 0; pdo < ids.size(); ++pdo) {
    out.objects.push_back(mapping_of(pdo, count, 64 / count));
  }
  out.objects.push_back(values(count, bits ? od::DataType::boolean : od::DataType::unsigned16));
  return out;
}

}  // namespace

std::vector<std::uint32_t> pdo_identifiers(std::size_t count) {
  std::vector<std::uint32_t> ids;
  for (std::uint32_t id = 0x181; id < 0x580; ++id) {
    ids.push_back(id);
  }
  std::shuffle(ids.begin(), ids.end(), std::mt19937(4711));
  ids.resize(count);
  return ids;
}

line::LineConfig pdo_line(Mapping mapping, std::span<const std::uint32_t> ids) {
  line::LineConfig config;
  config.name = "bench";
  config.bit_rate = 1'000'000;
  for (std::size_t first = 0; first < ids.size(); first += kPdosPerNode) {
    line::NodeConfig node;
    node.id = static_cast<std::uint8_t>(config.nodes.size() + 1);
    node.name = "n" + std::to_string(node.id);
    node.device = device(mapping, ids.subspan(first, std::min(kPdosPerNode, ids.size() - first)));
    node.check = {.device_type = false, .vendor = false, .product = false, .revision = false};
    node.pdo_deadline = kDeadline;
    config.nodes.push_back(std::move(node));
  }
  return config;
}

std::vector<can::Frame> pdo_frames(std::span<const std::uint32_t> ids, std::size_t count,
                                   Order order) {
  std::mt19937_64 random(42);
  std::vector<std::size_t> cycle(ids.size());
  std::iota(cycle.begin(), cycle.end(), 0U);
  std::vector<can::Frame> frames;
  std::vector<std::array<std::byte, 8>> values(ids.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (i % cycle.size() == 0)
      std::shuffle(cycle.begin(), cycle.end(), random);
    const std::size_t pdo =
        order == Order::cycles ? cycle[i % cycle.size()] : random() % ids.size();
    for (std::size_t pair = 0; pair < 4; ++pair) {
      std::byte& value = values[pdo][2 * pair + random() % 2];
      value = static_cast<std::byte>(std::to_integer<unsigned>(value) + 1 + random() % 255);
    }
    frames.push_back(can::make_frame(ids[pdo], values[pdo]));
  }
  return frames;
}

}  // namespace linegate::bench
