// SPDX-License-Identifier: Apache-2.0
#include "stack/profile/io_device.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::profile {
namespace {

using od::Access;
using od::DataType;
using od::ObjectDescription;
using od::ObjectType;
using od::VariableDescription;
namespace cia401 = od::objects::cia401;

constexpr unsigned kPdos = 4;
constexpr unsigned kMapped = 8;            // entries of a mapping record
constexpr unsigned kDigitalInPdo = 8;      // blocks in PDO 1
constexpr unsigned kAnalogueInPdo = 4;     // channels in each of PDO 2 to 4
constexpr std::uint8_t kErrorHistory = 8;  // entries of 1003h
constexpr std::uint8_t kConsumers = 4;     // entries of 1016h
constexpr std::uint32_t kErrorModes = 0xFF;

// Name and type of each object are from the catalogue.
const od::objects::Entry& entry_of(std::uint16_t index) {
  const od::objects::Entry* const common = od::objects::find(index);
  return common != nullptr ? *common : od::objects::at(index, cia401::kProfile);
}

ObjectDescription io_single(std::uint16_t index, Access access, std::uint64_t value = 0) {
  const od::objects::Entry& entry = entry_of(index);
  ObjectDescription out{.index = index, .name = std::string(entry.name)};
  out.variables.push_back(od::number_variable(0, out.name, entry.type, access, value));
  return out;
}

ObjectDescription io_array(std::uint16_t index, const std::string& element, Access access,
                           unsigned count, std::uint64_t value = 0) {
  const od::objects::Entry& entry = entry_of(index);
  ObjectDescription out{.index = index, .name = std::string(entry.name), .type = ObjectType::array};
  out.variables.push_back(od::number_variable(0, "Highest sub-index supported", DataType::unsigned8,
                                              Access::constant, count));
  for (unsigned i = 1; i <= count; ++i) {
    out.variables.push_back(od::number_variable(static_cast<std::uint8_t>(i),
                                                element + ' ' + std::to_string(i), entry.type,
                                                access, value));
  }
  return out;
}

ObjectDescription io_text(std::uint16_t index, const std::string& text) {
  ObjectDescription out = io_single(index, Access::constant);
  out.variables[0].value.clear();
  for (const char c : text) {
    out.variables[0].value.push_back(static_cast<std::byte>(c));
  }
  return out;
}

void make_mappable(ObjectDescription& object) {
  for (VariableDescription& variable : object.variables) {
    variable.mappable = variable.sub != 0;
  }
}

class IoDevice {
 public:
  IoDevice(const IoBlocks& blocks, std::string name, std::uint8_t node_id, bool stores)
      : blocks_(blocks), name_(std::move(name)), node_id_(node_id), stores_(stores) {}

  od::DeviceDescription make() {
    add_communication();
    if (stores_) {
      add_storage();
    }
    add_pdos(false);
    add_pdos(true);
    add_digital();
    add_analogue();
    std::ranges::sort(device_.objects, {}, &ObjectDescription::index);
    device_.vendor_name = "Linegate";
    device_.product_name = "Generic I/O module (CiA 401)";
    device_.node_id = node_id_;
    return std::move(device_);
  }

 private:
  void add(ObjectDescription object) { device_.objects.push_back(std::move(object)); }

  std::uint32_t device_type() const {
    constexpr std::uint32_t kDigitalIn = 1U << 16U;
    constexpr std::uint32_t kDigitalOut = 1U << 17U;
    constexpr std::uint32_t kAnalogueIn = 1U << 18U;
    constexpr std::uint32_t kAnalogueOut = 1U << 19U;
    return kIoProfile | (blocks_.digital_inputs != 0 ? kDigitalIn : 0U) |
           (blocks_.digital_outputs != 0 ? kDigitalOut : 0U) |
           (blocks_.analogue_inputs != 0 ? kAnalogueIn : 0U) |
           (blocks_.analogue_outputs != 0 ? kAnalogueOut : 0U);
  }

  void add_communication() {
    add(io_single(od::objects::kDeviceType, Access::ro, device_type()));
    add(io_single(od::objects::kErrorRegister, Access::ro));
    ObjectDescription history =
        io_array(od::objects::kErrorHistory, "Standard error field", Access::ro, kErrorHistory);
    history.variables[0] =
        od::number_variable(0, "Number of errors", DataType::unsigned8, Access::rw);
    add(std::move(history));
    add(io_single(od::objects::kSyncCobId, Access::rw, can::kSyncId));
    add(io_text(od::objects::kDeviceName, name_));
    add(io_single(od::objects::kGuardTime, Access::rw));
    add(io_single(od::objects::kLifeTimeFactor, Access::rw));
    ObjectDescription emcy =
        io_single(od::objects::kEmcyCobId, Access::rw, can::kEmcyBase + node_id_);
    emcy.variables[0].notes.value_formula = true;
    add(std::move(emcy));
    add(io_single(od::objects::kEmcyInhibitTime, Access::rw));
    add(io_array(od::objects::kConsumerHeartbeatTime, "Consumer heartbeat time", Access::rw,
                 kConsumers));
    add(io_single(od::objects::kProducerHeartbeatTime, Access::rw));
    add(od::identity_object());
    add(io_array(od::objects::kErrorBehaviour, "Communication error", Access::rw, 1));
  }

  // By group, as in stack/storage: all, communication, application, manufacturer.
  void add_storage() {
    constexpr unsigned kGroups = 4;
    add(io_array(od::objects::kStoreParameters, "Group", Access::rw, kGroups));
    add(io_array(od::objects::kRestoreDefaults, "Group", Access::rw, kGroups));
    add(io_array(od::objects::kVerifyConfiguration, "Configuration date and time", Access::rw, 2));
  }

  // The default mapping of a PDO in the profile, as raw mapping entries.
  std::vector<std::uint32_t> default_mapping(bool transmit, unsigned number) const {
    const bool digital = number == 1;
    const unsigned digitals = transmit ? blocks_.digital_inputs : blocks_.digital_outputs;
    const unsigned analogues = transmit ? blocks_.analogue_inputs : blocks_.analogue_outputs;
    const unsigned have = digital ? digitals : analogues;
    const unsigned fit = digital ? kDigitalInPdo : kAnalogueInPdo;
    const unsigned first = digital ? 1 : (number - 2) * kAnalogueInPdo + 1;
    const std::uint32_t index = digital    ? (transmit ? 0x6000U : 0x6200U)
                                : transmit ? 0x6401U
                                           : 0x6411U;
    std::vector<std::uint32_t> out;
    for (unsigned sub = first; sub < first + fit && sub <= have; ++sub) {
      out.push_back(index << 16U | sub << 8U | (digital ? 8U : 16U));
    }
    return out;
  }

  void add_pdos(bool transmit) {
    const std::string kind = transmit ? "TPDO" : "RPDO";
    for (unsigned number = 1; number <= kPdos; ++number) {
      const auto offset = static_cast<std::uint16_t>((transmit ? 0x400U : 0U) + number - 1U);
      const std::vector<std::uint32_t> mapping = default_mapping(transmit, number);
      add(communication(static_cast<std::uint16_t>(0x1400U + offset),
                        kind + " communication parameter " + std::to_string(number),
                        (transmit ? can::default_tpdo_id(number, node_id_)
                                  : can::default_rpdo_id(number, node_id_)) |
                            (mapping.empty() ? can::CobId::kInvalidBit : 0U),
                        transmit));
      ObjectDescription record{.index = static_cast<std::uint16_t>(0x1600U + offset),
                               .name = kind + " mapping parameter " + std::to_string(number),
                               .type = ObjectType::record};
      record.variables.push_back(od::number_variable(
          0, "Number of mapped objects", DataType::unsigned8, Access::rw, mapping.size()));
      for (unsigned i = 0; i < kMapped; ++i) {
        record.variables.push_back(od::number_variable(
            static_cast<std::uint8_t>(i + 1), "Mapped object " + std::to_string(i + 1),
            DataType::unsigned32, Access::rw, i < mapping.size() ? mapping[i] : 0U));
      }
      add(std::move(record));
    }
  }

  static ObjectDescription communication(std::uint16_t index, std::string name,
                                         std::uint32_t cob_id, bool transmit) {
    ObjectDescription out{.index = index, .name = std::move(name), .type = ObjectType::record};
    out.variables = {
        od::number_variable(0, "Highest sub-index supported", DataType::unsigned8, Access::constant,
                            5),
        od::number_variable(1, "COB-ID", DataType::unsigned32, Access::rw, cob_id),
        od::number_variable(2, "Transmission type", DataType::unsigned8, Access::rw, 255),
    };
    out.variables[1].notes.value_formula = true;
    if (transmit) {
      out.variables.push_back(
          od::number_variable(3, "Inhibit time", DataType::unsigned16, Access::rw));
    }
    out.variables.push_back(
        od::number_variable(5, "Event timer", DataType::unsigned16, Access::rw));
    return out;
  }

  void add_digital() {
    if (const unsigned n = blocks_.digital_inputs; n != 0) {
      ObjectDescription inputs = io_array(cia401::kDigitalInputs, "Inputs", Access::ro, n);
      make_mappable(inputs);
      add(std::move(inputs));
      add(io_array(cia401::kDigitalInputPolarity, "Polarity", Access::rw, n));
      add(io_single(cia401::kDigitalInterrupts, Access::rw, 1));
      add(io_array(cia401::kInterruptAnyChange, "Any change", Access::rw, n, 0xFF));
      add(io_array(cia401::kInterruptLowToHigh, "Low to high", Access::rw, n));
      add(io_array(cia401::kInterruptHighToLow, "High to low", Access::rw, n));
    }
    if (const unsigned n = blocks_.digital_outputs; n != 0) {
      ObjectDescription outputs = io_array(cia401::kDigitalOutputs, "Outputs", Access::rww, n);
      make_mappable(outputs);
      add(std::move(outputs));
      add(io_array(cia401::kDigitalOutputPolarity, "Polarity", Access::rw, n));
      add(io_array(cia401::kDigitalErrorMode, "Error mode", Access::rw, n, kErrorModes));
      add(io_array(cia401::kDigitalErrorValue, "Error value", Access::rw, n));
      add(io_array(cia401::kDigitalOutputFilter, "Filter mask", Access::rw, n, 0xFF));
    }
  }

  void add_analogue() {
    if (const unsigned n = blocks_.analogue_inputs; n != 0) {
      ObjectDescription inputs = io_array(cia401::kAnalogueInputs, "Analogue input", Access::ro, n);
      make_mappable(inputs);
      add(std::move(inputs));
      add(io_array(cia401::kAnalogueTrigger, "Trigger", Access::rw, n, 4));
      add(io_single(cia401::kAnalogueInterrupts, Access::rw));
      const auto channels = [&](std::uint16_t index, const std::string& element,
                                std::uint64_t value = 0) {
        add(io_array(index, element, Access::rw, n, value));
      };
      channels(cia401::kAnalogueUpperLimit, "Upper limit");
      channels(cia401::kAnalogueLowerLimit, "Lower limit");
      channels(cia401::kAnalogueDelta, "Delta");
      channels(cia401::kAnalogueNegativeDelta, "Negative delta");
      channels(cia401::kAnaloguePositiveDelta, "Positive delta");
      channels(cia401::kAnalogueInputOffset, "Offset");
      channels(cia401::kAnalogueInputScaling, "Scaling", 1);
    }
    if (const unsigned n = blocks_.analogue_outputs; n != 0) {
      ObjectDescription outputs =
          io_array(cia401::kAnalogueOutputs, "Analogue output", Access::rww, n);
      make_mappable(outputs);
      add(std::move(outputs));
      add(io_array(cia401::kAnalogueErrorMode, "Error mode", Access::rw, n, 1));
      add(io_array(cia401::kAnalogueErrorValue, "Error value", Access::rw, n));
      add(io_array(cia401::kAnalogueOutputOffset, "Offset", Access::rw, n));
      add(io_array(cia401::kAnalogueOutputScaling, "Scaling", Access::rw, n, 1));
    }
  }

  const IoBlocks blocks_;
  const std::string name_;
  const std::uint8_t node_id_;
  const bool stores_;
  od::DeviceDescription device_;
};

}  // namespace

od::DeviceDescription make_io_device(const IoBlocks& blocks, const std::string& name,
                                     std::uint8_t node_id, bool stores) {
  return IoDevice(blocks, name, node_id, stores).make();
}

}  // namespace linegate::profile
