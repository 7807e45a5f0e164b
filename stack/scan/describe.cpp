// SPDX-License-Identifier: Apache-2.0
#include "stack/scan/describe.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::scan {
namespace {

using od::Access;
using od::DataType;

constexpr od::Address kAnalogueInterrupts{od::objects::cia401::kAnalogueInterrupts, 0};

struct Known {
  std::string name;
  DataType type;
};

// The catalogue's data of a sub-index that is not a PDO parameter.
std::optional<Known> known(od::Address address) {
  if (address.index == od::objects::kIdentity) {
    const od::ObjectDescription identity = od::identity_object();
    if (address.sub >= identity.variables.size()) {
      return std::nullopt;
    }
    return Known{identity.variables[address.sub].name, identity.variables[address.sub].type};
  }
  const od::objects::Entry* const entry =
      address == kAnalogueInterrupts
          ? od::objects::find(address.index, od::objects::cia401::kProfile)
          : od::objects::find(address.index);
  if (address.sub != 0 || entry == nullptr || entry->object != od::ObjectType::variable) {
    return std::nullopt;
  }
  return Known{std::string(entry->name), entry->type};
}

constexpr std::string_view kCommunication[] = {"Highest sub-index supported",
                                               "COB-ID",
                                               "Transmission type",
                                               "Inhibit time",
                                               "Reserved",
                                               "Event timer",
                                               "SYNC start value"};

DataType unsigned_of(std::size_t bytes) {
  constexpr DataType kTypes[] = {DataType::none,       DataType::unsigned8,  DataType::unsigned16,
                                 DataType::unsigned24, DataType::unsigned32, DataType::unsigned40,
                                 DataType::unsigned48, DataType::unsigned56, DataType::unsigned64};
  return bytes < std::size(kTypes) ? kTypes[bytes] : DataType::octet_string;
}

DataType type_of_bits(unsigned bits) {
  if (bits == 1) {
    return DataType::boolean;
  }
  return bits % 8 == 0 && bits <= 64 ? unsigned_of(bits / 8) : DataType::octet_string;
}

bool is_communication(std::uint16_t index) {
  return od::objects::is_pdo_communication(index);
}
bool is_mapping(std::uint16_t index) {
  return od::objects::is_pdo_mapping(index);
}

std::string hex(std::uint32_t number, int digits) {
  std::string out;
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    out += "0123456789ABCDEF"[number >> static_cast<unsigned>(shift) & 0xFU];
  }
  return out;
}

// A report may name sub-indices that CiA 301 does not define.
std::string name_of_parameter(std::uint8_t sub) {
  return sub < std::size(kCommunication) ? std::string(kCommunication[sub])
                                         : "Parameter " + std::to_string(sub);
}

std::string name_of_record(std::uint16_t index) {
  const bool sent = index >= od::objects::kTpdoCommunication;
  const unsigned number = (index & 0x1FFU) + 1U;
  return std::string(sent ? "TPDO " : "RPDO ") + std::to_string(number) +
         (is_mapping(index) ? " mapping" : " communication");
}

class Describer {
 public:
  explicit Describer(const ScannedNode& node) : node_(node) {
    out_.node_id = node.id;
    const auto id = [&](std::uint8_t sub) {
      return static_cast<std::uint32_t>(node.number({od::objects::kIdentity, sub}).value_or(0));
    };
    out_.vendor_number = id(1);
    out_.product_number = id(2);
    out_.revision_number = id(3);
    if (const auto* name = node.find({od::objects::kDeviceName, 0})) {
      for (const std::byte character : *name) {
        out_.product_name += static_cast<char>(character);
      }
    }
  }

  od::DeviceDescription run() && {
    for (const manager::ObjectWrite& value : node_.values) {
      add_read(value);
    }
    for (const manager::ObjectWrite& value : node_.values) {
      if (is_mapping(value.address.index) && value.address.sub != 0) {
        add_mapped(value);
      }
    }
    finish();
    return std::move(out_);
  }

 private:
  void add_read(const manager::ObjectWrite& value) {
    const std::optional<Known> found = known(value.address);
    const std::uint16_t index = value.address.index;
    od::VariableDescription variable{.sub = value.address.sub, .value = value.data};
    if (found) {
      variable.name = found->name;
      variable.type = found->type;
      const bool settable =
          index == od::objects::kSyncCobId || index == od::objects::kSyncPeriod ||
          index == od::objects::kGuardTime || index == od::objects::kLifeTimeFactor ||
          index == od::objects::kEmcyCobId || index == od::objects::kProducerHeartbeatTime ||
          value.address == kAnalogueInterrupts;
      variable.access = settable ? Access::rw : Access::ro;
    } else {
      variable.type = unsigned_of(value.data.size());
      variable.access = variable.sub == 0 && !is_mapping(index) ? Access::ro : Access::rw;
      variable.name = is_communication(index) ? name_of_parameter(variable.sub)
                      : variable.sub == 0     ? "Number of mapped objects"
                                              : "Mapped object " + std::to_string(variable.sub);
    }
    od::ObjectDescription& object = object_at(index);
    object.type = index == od::objects::kIdentity || !found ? od::ObjectType::record
                                                            : od::ObjectType::variable;
    object.name = index == od::objects::kIdentity ? std::string(od::objects::at(index).name)
                  : !found                        ? name_of_record(index)
                                                  : variable.name;
    object.variables.push_back(std::move(variable));
  }

  void add_mapped(const manager::ObjectWrite& value) {
    const auto mapped = static_cast<std::uint32_t>(load_le(
        std::span<const std::byte>(value.data).first(std::min<std::size_t>(value.data.size(), 4))));
    const od::Address address{static_cast<std::uint16_t>(mapped >> 16U),
                              static_cast<std::uint8_t>(mapped >> 8U)};
    const unsigned bits = mapped & 0xFFU;
    const bool sent = value.address.index >= od::objects::kTpdoMapping;
    if (bits == 0) {
      return;
    }
    if (address.index < od::objects::kFirstCommunication) {
      out_.dummy_types |= address.index < 32 ? 1U << address.index : 0U;
      return;
    }
    od::ObjectDescription& object = object_at(address.index);
    const auto there =
        std::ranges::find(object.variables, address.sub, &od::VariableDescription::sub);
    if (there != object.variables.end()) {
      if (!sent) {  // both sent and received
        there->access = there->access == Access::ro ? Access::rw : there->access;
      }
      there->mappable = true;
      return;
    }
    od::VariableDescription variable{.sub = address.sub,
                                     .name = od::to_text(address),
                                     .type = type_of_bits(bits),
                                     .access = sent ? Access::ro : Access::rww,
                                     .mappable = true};
    variable.value.resize((bits + 7) / 8);
    object.name = object.name.empty() ? hex(address.index, 4) : object.name;
    object.variables.push_back(std::move(variable));
  }

  // Sub-index 0 holds the number of the sub-indices, unless it is the only one.
  void finish() {
    for (od::ObjectDescription& object : out_.objects) {
      std::ranges::sort(object.variables, {}, &od::VariableDescription::sub);
      if (object.variables.size() == 1 && object.variables.front().sub == 0) {
        continue;
      }
      object.type = od::ObjectType::record;
      if (object.variables.front().sub != 0) {
        object.variables.insert(object.variables.begin(),
                                {.sub = 0,
                                 .name = "Highest sub-index supported",
                                 .type = DataType::unsigned8,
                                 .access = Access::ro,
                                 .value = {std::byte{object.variables.back().sub}}});
      }
    }
  }

  od::ObjectDescription& object_at(std::uint16_t index) {
    const auto at =
        std::ranges::lower_bound(out_.objects, index, {}, &od::ObjectDescription::index);
    if (at != out_.objects.end() && at->index == index) {
      return *at;
    }
    return *out_.objects.insert(at, {.index = index});
  }

  const ScannedNode& node_;
  od::DeviceDescription out_;
};

}  // namespace

od::DeviceDescription describe(const ScannedNode& node) {
  return Describer(node).run();
}

}  // namespace linegate::scan
