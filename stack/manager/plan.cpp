// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/plan.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"
#include "stack/pdo/described_cob_id.h"
#include "stack/pdo/parameters.h"

namespace linegate::manager {
namespace {

constexpr std::uint16_t kMappingOffset = 0x200;  // 1400h -> 1600h, 1800h -> 1A00h

bool is_pdo_communication(std::uint16_t index) {
  return od::objects::is_pdo_communication(index);
}
bool is_pdo_mapping(std::uint16_t index) {
  return od::objects::is_pdo_mapping(index);
}

bool to_be_written(const od::VariableDescription& variable) {
  return variable.configured && od::writable(variable.access);
}

bool any_configured(const od::ObjectDescription* object) {
  return object != nullptr && std::ranges::any_of(object->variables, to_be_written);
}

ObjectWrite write_of(std::uint16_t index, const od::VariableDescription& variable) {
  return {{index, variable.sub}, variable.value};
}

ObjectWrite write_u32(od::Address address, std::uint32_t value) {
  ObjectWrite write{address, std::vector<std::byte>(4)};
  store_le(std::span(write.data), value);
  return write;
}

const od::VariableDescription* sub(const od::ObjectDescription& object, std::uint8_t number) {
  const auto it = std::ranges::find(object.variables, number, &od::VariableDescription::sub);
  return it == object.variables.end() ? nullptr : &*it;
}

void append_mapping(const od::ObjectDescription& mapping, std::vector<ObjectWrite>& out) {
  const od::VariableDescription* count = sub(mapping, 0);
  if (count == nullptr || !od::writable(count->access)) {
    return;
  }
  out.push_back({{mapping.index, 0}, {std::byte{0}}});
  const std::uint64_t entries = load_le(std::span<const std::byte>(count->value));
  for (const od::VariableDescription& variable : mapping.variables) {
    if (variable.sub >= 1 && variable.sub <= entries && od::writable(variable.access)) {
      out.push_back(write_of(mapping.index, variable));
    }
  }
  out.push_back(write_of(mapping.index, *count));
}

// Valid only if a PDO may have the identifier (CiA 301 7.3.5).
can::CobId written_cob_id(const od::DeviceDescription& device, std::uint16_t record) {
  const bool sent = record >= pdo::communication_base(pdo::PdoKind::tpdo);
  const pdo::PdoKind kind = sent ? pdo::PdoKind::tpdo : pdo::PdoKind::rpdo;
  const auto number = static_cast<std::uint16_t>(record - pdo::communication_base(kind) + 1);
  const can::CobId said = pdo::described_cob_id(device, kind, number);
  return {can::is_usable(said) ? said.raw : said.raw | can::CobId::kInvalidBit};
}

const od::ObjectDescription* mapping_of(const od::DeviceDescription& device,
                                        const od::ObjectDescription& communication) {
  return device.find(static_cast<std::uint16_t>(communication.index + kMappingOffset));
}

// The remapping procedure. mapping: nullptr leaves it. is_written: which other parameters of the
// communication record are.
template <class IsWritten>
void append_pdo(const od::DeviceDescription& device, const od::ObjectDescription& communication,
                const od::ObjectDescription* mapping, IsWritten is_written,
                std::vector<ObjectWrite>& out) {
  const od::VariableDescription* cob_id = sub(communication, 1);
  if (cob_id == nullptr) {
    return;
  }
  const can::CobId cob = written_cob_id(device, communication.index);
  const bool can_switch = od::writable(cob_id->access);
  if (can_switch) {
    out.push_back(write_u32({communication.index, 1}, cob.raw | can::CobId::kInvalidBit));
  }
  if (mapping != nullptr) {
    append_mapping(*mapping, out);
  }
  for (const od::VariableDescription& variable : communication.variables) {
    if (variable.sub >= 2 && is_written(variable)) {
      out.push_back(write_of(communication.index, variable));
    }
  }
  if (can_switch) {
    out.push_back(write_u32({communication.index, 1}, cob.raw));
  }
}

void append_configured_pdo(const od::DeviceDescription& device,
                           const od::ObjectDescription& communication,
                           std::vector<ObjectWrite>& out) {
  const od::ObjectDescription* const mapping = mapping_of(device, communication);
  if (any_configured(&communication) || any_configured(mapping)) {
    append_pdo(device, communication, any_configured(mapping) ? mapping : nullptr, to_be_written,
               out);
  }
}

ObjectWrite write_u8(od::Address address, std::size_t value) {
  return {address, {static_cast<std::byte>(value)}};
}

// Those that can be changed, and of which the file has a value.
std::vector<ObjectWrite> parameters_of(const od::DeviceDescription& device, pdo::PdoKind kind,
                                       const pdo::Parameters& pdo) {
  const auto record = static_cast<std::uint16_t>(pdo::communication_base(kind) + pdo.number - 1);
  const auto mapping = static_cast<std::uint16_t>(record + kMappingOffset);
  std::vector<ObjectWrite> out;
  const auto append = [&](ObjectWrite parameter) {
    const od::VariableDescription* const variable = device.find(parameter.address);
    if (variable != nullptr && od::writable(variable->access)) {
      out.push_back(std::move(parameter));
    }
  };
  append(write_u32({record, 1}, pdo.cob_id.raw));
  const od::VariableDescription* const type = device.find(od::Address{record, 2});
  if (kind == pdo::PdoKind::rpdo && type != nullptr && !type->value.empty()) {
    append(write_u8({record, 2}, pdo.type));
  }
  append(write_u8({mapping, 0}, pdo.mapping.size()));
  for (std::size_t i = 0; i < pdo.mapping.size(); ++i) {
    append(write_u32({mapping, static_cast<std::uint8_t>(i + 1)}, pdo.mapping[i].raw()));
  }
  return out;
}

std::vector<ObjectWrite> remedy_of(const od::DeviceDescription& device, std::uint16_t record) {
  std::vector<ObjectWrite> out;
  if (const od::ObjectDescription* const communication = device.find(record)) {
    const auto is_type = [](const od::VariableDescription& variable) {
      return variable.sub == 2 && od::writable(variable.access) && !variable.value.empty();
    };
    append_pdo(device, *communication, mapping_of(device, *communication), is_type, out);
  }
  return out;
}

}  // namespace

std::vector<ObjectWrite> configuration_writes(const od::DeviceDescription& device) {
  std::vector<ObjectWrite> out;
  constexpr std::uint32_t kNotWritten = 1;  // CiA 306 ObjFlags
  for (const od::ObjectDescription& object : device.objects) {
    if (is_pdo_communication(object.index) || is_pdo_mapping(object.index) ||
        (object.flags & kNotWritten) != 0) {
      continue;
    }
    for (const od::VariableDescription& variable : object.variables) {
      if (to_be_written(variable)) {
        out.push_back(write_of(object.index, variable));
      }
    }
  }
  for (const od::ObjectDescription& object : device.objects) {
    if (is_pdo_communication(object.index)) {
      append_configured_pdo(device, object, out);
    }
  }
  return out;
}

std::vector<AssumedPdo> assumed_pdos(const od::DeviceDescription& device, bool correct,
                                     std::size_t max_bits) {
  std::vector<AssumedPdo> out;
  const Loaded<pdo::DevicePdos> described = pdo::describe_pdos(device, max_bits);
  if (!described.ok()) {
    return out;
  }
  const auto append = [&](pdo::PdoKind kind, const std::vector<pdo::Parameters>& pdos) {
    for (const pdo::Parameters& pdo : pdos) {
      if (!can::is_usable(pdo.cob_id)) {
        continue;  // append_pdo() writes it as not valid
      }
      const auto record =
          static_cast<std::uint16_t>(pdo::communication_base(kind) + pdo.number - 1);
      AssumedPdo assumed{.parameters = parameters_of(device, kind, pdo), .remedy = {}};
      if (!assumed.parameters.empty() && correct) {
        assumed.remedy = remedy_of(device, record);
      }
      const od::VariableDescription* const type = device.find(od::Address{record, 2});
      const bool changes =
          type == nullptr ? !assumed.parameters.empty() : od::writable(type->access);
      if (kind == pdo::PdoKind::tpdo && changes) {
        assumed.sent = AssumedPdo::Transmission{.record = record, .type = pdo.type};
      }
      if (!assumed.parameters.empty() || assumed.sent) {
        out.push_back(std::move(assumed));
      }
    }
  };
  append(pdo::PdoKind::tpdo, described.value->tpdos);
  append(pdo::PdoKind::rpdo, described.value->rpdos);
  return out;
}

namespace {

pdo::PdoKind kind_of_record(std::uint16_t record) {
  return record >= pdo::communication_base(pdo::PdoKind::tpdo) ? pdo::PdoKind::tpdo
                                                               : pdo::PdoKind::rpdo;
}

using TakenIds = std::array<std::shared_ptr<CobIds>, 2>;  // by PdoKind

TakenIds taken_ids(std::span<const od::DeviceDescription* const> devices, std::size_t max_bits) {
  TakenIds out{std::make_shared<CobIds>(), std::make_shared<CobIds>()};
  for (const od::DeviceDescription* device : devices) {
    const Loaded<pdo::DevicePdos> described = pdo::describe_pdos(*device, max_bits);
    if (!described.ok()) {
      continue;
    }
    for (const pdo::PdoKind kind : {pdo::PdoKind::rpdo, pdo::PdoKind::tpdo}) {
      const bool sent = kind == pdo::PdoKind::tpdo;
      for (const pdo::Parameters& pdo : sent ? described.value->tpdos : described.value->rpdos) {
        out[static_cast<std::size_t>(kind)]->push_back(pdo.cob_id.id() |
                                                       (pdo.cob_id.raw & can::CobId::kExtendedBit));
      }
    }
  }
  return out;
}

bool has_record(const NodePlan& plan, std::uint16_t record) {
  return std::ranges::any_of(plan.pdos, [record](const AssumedPdo& pdo) {
    if (pdo.parameters.empty()) {
      return false;  // its COB-ID is constant
    }
    const std::uint16_t index = pdo.parameters.front().address.index;
    return index == record || index == record + kMappingOffset;
  });
}

}  // namespace

void add_other_pdos(std::span<const od::DeviceDescription* const> devices,
                    const std::vector<bool>& correct, std::span<NodePlan> plans,
                    std::size_t max_bits) {
  const TakenIds taken = taken_ids(devices, max_bits);
  for (std::size_t i = 0; i < plans.size(); ++i) {
    std::vector<AssumedPdo> others;
    for (const od::ObjectDescription& object : devices[i]->objects) {
      const od::VariableDescription* const cob_id =
          od::objects::is_pdo_communication(object.index) ? sub(object, 1) : nullptr;
      if (cob_id == nullptr || !od::writable(cob_id->access) ||
          has_record(plans[i], object.index)) {
        continue;
      }
      const ObjectWrite off = write_u32({object.index, 1}, can::CobId::kInvalidBit);
      others.push_back({.parameters = {off},
                        .remedy = correct[i] ? std::vector{off} : std::vector<ObjectWrite>{},
                        .taken = taken[static_cast<std::size_t>(kind_of_record(object.index))]});
    }
    std::ranges::move(others, std::back_inserter(plans[i].pdos));
  }
}

void date_last(std::vector<ObjectWrite>& writes) {
  for (const std::uint16_t index :
       {od::objects::kVerifyConfiguration, od::objects::kStoreParameters}) {
    std::stable_partition(writes.begin(), writes.end(), [index](const ObjectWrite& write) {
      return write.address.index != index;
    });
  }
}

ConfigurationDate date_of(std::span<const ObjectWrite> writes) {
  ConfigurationDate out;
  for (const ObjectWrite& write : writes) {
    if (write.address.index == od::objects::kVerifyConfiguration && write.data.size() == 4) {
      const auto value = load_le<std::uint32_t>(write.data.data());
      (write.address.sub == 1 ? out.date : out.time) = value;
    }
  }
  return out;
}

// FNV-1a. The result is a date within the next hundred years and whole milliseconds of a day,
// neither of them 0.
ConfigurationDate fingerprint_of(std::span<const ObjectWrite> writes,
                                 std::span<const AssumedPdo> pdos) {
  constexpr std::uint32_t kDays = 36'500;
  constexpr std::uint32_t kMilliseconds = 86'399'999;
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  const auto add = [&hash](std::span<const ObjectWrite> values) {
    for (const std::byte byte : write_concise_dcf(values)) {
      hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x0000'0100'0000'01B3;
    }
  };
  add(writes);
  for (const AssumedPdo& pdo : pdos) {
    add(pdo.parameters);
  }
  const auto low = static_cast<std::uint32_t>(hash);
  const auto high = static_cast<std::uint32_t>(hash >> 32U);
  return {.date = 1 + high % kDays, .time = 1 + low % kMilliseconds};
}

}  // namespace linegate::manager
