// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/eds/object.h"
#include "stack/od/objects.h"

namespace linegate::eds {
namespace {

using od::DataType;
using od::VariableDescription;

constexpr unsigned kMostPdos = 512;
constexpr std::uint8_t kMappingEntries = 64;
constexpr std::uint16_t kToMapping = 0x200;
constexpr std::uint32_t kNotValid = 0x8000'0000;

struct Direction {
  const char* name;
  std::uint16_t first;      // communication record of PDO 1
  std::uint16_t cob_id;     // of PDO 1 of the predefined connection set, without the node-ID
  std::uint16_t described;  // value of NrOfRXPDO or NrOfTXPDO
};

VariableDescription variable(std::uint8_t sub, std::string name, DataType type,
                             std::uint64_t value) {
  VariableDescription out;
  out.sub = sub;
  out.name = std::move(name);
  out.type = type;
  out.value.resize(od::byte_size(type));
  store_le(std::span<std::byte>(out.value), value);
  return out;
}

class Builder {
 public:
  Builder(const Ini& ini, DataSheet& sheet, Context& context) : sheet_(sheet), context_(context) {
    const Section* section = ini.find("DeviceInfo");
    place_ = section->find("CompactPDO")->value_place;
  }

  void add(const Direction& direction) {
    std::array<bool, kMostPdos> wanted{};
    unsigned left = direction.described;
    for (unsigned i = 0; i < kMostPdos; ++i) {
      wanted[i] = has(direction, i);
      left -= wanted[i] && left != 0 ? 1U : 0U;
    }
    for (unsigned i = 0; i < kMostPdos && left != 0; ++i) {
      left -= wanted[i] ? 0U : 1U;
      wanted[i] = true;
    }
    for (unsigned i = 0; i < kMostPdos; ++i) {
      if (wanted[i]) {
        complete(direction, i);
      }
    }
  }

 private:
  static std::uint16_t communication(const Direction& direction, unsigned i) {
    return static_cast<std::uint16_t>(direction.first + i);
  }

  bool has(const Direction& direction, unsigned i) const {
    const std::uint16_t index = communication(direction, i);
    return described(index) || described(static_cast<std::uint16_t>(index + kToMapping));
  }

  // Added objects are at the end and are not searched.
  bool described(std::uint16_t index) const { return sheet_.device.find(index) != nullptr; }

  void complete(const Direction& direction, unsigned i) {
    const std::uint16_t index = communication(direction, i);
    const auto mapping = static_cast<std::uint16_t>(index + kToMapping);
    const bool has_mapping = described(mapping);
    if (!described(index)) {
      insert(communication_record(direction, i));
    }
    if (!has_mapping) {
      insert(mapping_record(direction, i));
    }
  }

  od::ObjectDescription record(std::uint16_t index, std::string name) const {
    od::ObjectDescription out;
    out.index = index;
    out.name = std::move(name);
    out.type = od::ObjectType::record;
    out.line = place_.line;
    return out;
  }

  od::ObjectDescription communication_record(const Direction& direction, unsigned i) {
    static constexpr std::pair<const char*, DataType> kSubs[] = {
        {"COB-ID", DataType::unsigned32},       {"Transmission type", DataType::unsigned8},
        {"Inhibit time", DataType::unsigned16}, {"Compatibility entry", DataType::unsigned8},
        {"Event timer", DataType::unsigned16},  {"SYNC start value", DataType::unsigned8}};
    const std::string number = std::to_string(i + 1);
    auto out = record(communication(direction, i),
                      std::string(direction.name) + " communication parameter " + number);
    std::uint8_t highest = 0;
    for (std::uint8_t n = 0; n < std::size(kSubs); ++n) {
      if ((sheet_.info.compact_pdo >> n & 1U) == 0) {
        continue;
      }
      highest = static_cast<std::uint8_t>(n + 1);
      const std::uint64_t value = n == 0 ? cob_id(direction, i) : n == 1 ? 0xFF : 0;
      out.variables.push_back(variable(highest, kSubs[n].first, kSubs[n].second, value));
      if (n == 0) {
        out.variables.back().notes.value_formula = i < 4;
      }
    }
    out.variables.insert(out.variables.begin(), count_variable(highest, place_.line));
    return out;
  }

  std::uint32_t cob_id(const Direction& direction, unsigned i) {
    if (i >= 4) {
      return kNotValid;
    }
    if (context_.node_id == 0 && !context_.missing_node_id_reported) {
      context_.missing_node_id_reported = true;
      context_.report.error(place_,
                            "CompactPDO: the COB-IDs depend on the node-ID, but none is given");
    }
    return direction.cob_id + 0x100U * i + context_.node_id;
  }

  od::ObjectDescription mapping_record(const Direction& direction, unsigned i) const {
    auto out = record(static_cast<std::uint16_t>(communication(direction, i) + kToMapping),
                      std::string(direction.name) + " mapping parameter " + std::to_string(i + 1));
    out.variables.push_back(variable(0, "Number of mapped objects", DataType::unsigned8, 0));
    for (std::uint8_t sub = 1; sub <= kMappingEntries; ++sub) {
      out.variables.push_back(
          variable(sub, "Mapped object " + std::to_string(sub), DataType::unsigned32, 0));
    }
    return out;
  }

  void insert(od::ObjectDescription object) {
    auto& objects = sheet_.device.objects;
    const auto at = std::lower_bound(
        objects.begin(), objects.end(), object.index,
        [](const od::ObjectDescription& o, std::uint16_t index) { return o.index < index; });
    objects.insert(at, std::move(object));
  }

  DataSheet& sheet_;
  Context& context_;
  Place place_;
};

}  // namespace

void add_compact_pdos(const Ini& ini, DataSheet& sheet, Context& context) {
  if (sheet.info.compact_pdo == 0) {
    return;
  }
  Builder builder(ini, sheet, context);
  builder.add({"RPDO", od::objects::kRpdoCommunication, 0x200, sheet.info.rpdos});
  builder.add({"TPDO", od::objects::kTpdoCommunication, 0x180, sheet.info.tpdos});
}

}  // namespace linegate::eds
