// SPDX-License-Identifier: Apache-2.0
#include "stack/profile/io_device.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/od/number_variable.h"

namespace linegate::profile {
namespace {

using od::Access;
using od::DataType;
using od::ObjectDescription;
using od::ObjectType;
using od::VariableDescription;

constexpr unsigned kPdos = 4;
constexpr unsigned kMapped = 8;            // entries of a mapping record
constexpr unsigned kDigitalInPdo = 8;      // blocks in PDO 1
constexpr unsigned kAnalogueInPdo = 4;     // channels in each of PDO 2 to 4
constexpr std::uint8_t kErrorHistory = 8;  // entries of 1003h
constexpr std::uint8_t kConsumers = 4;     // entries of 1016h
constexpr std::uint32_t kErrorModes = 0xFF;

ObjectDescription io_single(std::uint16_t index, const std::string& name, DataType type,
                            Access access, std::uint64_t value = 0) {
  ObjectDescription out{.index = index, .name = name};
  out.variables.push_back(od::number_variable(0, name, type, access, value));
  return out;
}

ObjectDescription io_array(std::uint16_t index, const std::string& name, const std::string& element,
                           DataType type, Access access, unsigned count, std::uint64_t value = 0) {
  ObjectDescription out{.index = index, .name = name, .type = ObjectType::array};
  out.variables.push_back(od::number_variable(0, "Highest sub-index supported", DataType::unsigned8,
                                              Access::constant, count));
  for (unsigned i = 1; i <= count; ++i) {
    out.variables.push_back(od::number_variable(
        static_cast<std::uint8_t>(i), element + ' ' + std::to_string(i), type, access, value));
  }
  return out;
}

ObjectDescription io_text(std::uint16_t index, const std::string& name, const std::string& text) {
  ObjectDescription out = io_single(index, name, DataType::visible_string, Access::constant);
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
    add(io_single(0x1000, "Device type", DataType::unsigned32, Access::ro, device_type()));
    add(io_single(0x1001, "Error register", DataType::unsigned8, Access::ro));
    ObjectDescription history = io_array(0x1003, "Pre-defined error field", "Standard error field",
                                         DataType::unsigned32, Access::ro, kErrorHistory);
    history.variables[0] =
        od::number_variable(0, "Number of errors", DataType::unsigned8, Access::rw);
    add(std::move(history));
    add(io_single(0x1005, "COB-ID SYNC message", DataType::unsigned32, Access::rw, can::kSyncId));
    add(io_text(0x1008, "Manufacturer device name", name_));
    add(io_single(0x100C, "Guard time", DataType::unsigned16, Access::rw));
    add(io_single(0x100D, "Life time factor", DataType::unsigned8, Access::rw));
    ObjectDescription emcy = io_single(0x1014, "COB-ID EMCY", DataType::unsigned32, Access::rw,
                                       can::kEmcyBase + node_id_);
    emcy.variables[0].notes.value_formula = true;
    add(std::move(emcy));
    add(io_single(0x1015, "Inhibit time EMCY", DataType::unsigned16, Access::rw));
    add(io_array(0x1016, "Consumer heartbeat time", "Consumer heartbeat time", DataType::unsigned32,
                 Access::rw, kConsumers));
    add(io_single(0x1017, "Producer heartbeat time", DataType::unsigned16, Access::rw));
    ObjectDescription identity{
        .index = 0x1018, .name = "Identity object", .type = ObjectType::record};
    identity.variables = {
        od::number_variable(0, "Highest sub-index supported", DataType::unsigned8, Access::constant,
                            4),
        od::number_variable(1, "Vendor-ID", DataType::unsigned32, Access::ro),
        od::number_variable(2, "Product code", DataType::unsigned32, Access::ro),
        od::number_variable(3, "Revision number", DataType::unsigned32, Access::ro),
        od::number_variable(4, "Serial number", DataType::unsigned32, Access::ro),
    };
    add(std::move(identity));
    add(io_array(0x1029, "Error behaviour", "Communication error", DataType::unsigned8, Access::rw,
                 1));
  }

  // By group, as stack/storage has them: all, communication, application, manufacturer.
  void add_storage() {
    constexpr unsigned kGroups = 4;
    add(io_array(0x1010, "Store parameters", "Group", DataType::unsigned32, Access::rw, kGroups));
    add(io_array(0x1011, "Restore default parameters", "Group", DataType::unsigned32, Access::rw,
                 kGroups));
    add(io_array(0x1020, "Verify configuration", "Configuration date and time",
                 DataType::unsigned32, Access::rw, 2));
  }

  // What the profile maps into a PDO, as raw mapping entries.
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
    constexpr auto kByte = DataType::unsigned8;
    if (const unsigned n = blocks_.digital_inputs; n != 0) {
      ObjectDescription inputs =
          io_array(0x6000, "Read input 8-bit", "Inputs", kByte, Access::ro, n);
      make_mappable(inputs);
      add(std::move(inputs));
      add(io_array(0x6002, "Polarity input 8-bit", "Polarity", kByte, Access::rw, n));
      add(io_single(0x6005, "Global interrupt enable digital", DataType::boolean, Access::rw, 1));
      add(io_array(0x6006, "Interrupt mask any change 8-bit", "Any change", kByte, Access::rw, n,
                   0xFF));
      add(io_array(0x6007, "Interrupt mask low-to-high 8-bit", "Low to high", kByte, Access::rw,
                   n));
      add(io_array(0x6008, "Interrupt mask high-to-low 8-bit", "High to low", kByte, Access::rw,
                   n));
    }
    if (const unsigned n = blocks_.digital_outputs; n != 0) {
      ObjectDescription outputs =
          io_array(0x6200, "Write output 8-bit", "Outputs", kByte, Access::rww, n);
      make_mappable(outputs);
      add(std::move(outputs));
      add(io_array(0x6202, "Change polarity output 8-bit", "Polarity", kByte, Access::rw, n));
      add(io_array(0x6206, "Error mode output 8-bit", "Error mode", kByte, Access::rw, n,
                   kErrorModes));
      add(io_array(0x6207, "Error value output 8-bit", "Error value", kByte, Access::rw, n));
      add(io_array(0x6208, "Filter mask output 8-bit", "Filter mask", kByte, Access::rw, n, 0xFF));
    }
  }

  void add_analogue() {
    if (const unsigned n = blocks_.analogue_inputs; n != 0) {
      ObjectDescription inputs = io_array(0x6401, "Read analogue input 16-bit", "Analogue input",
                                          DataType::integer16, Access::ro, n);
      make_mappable(inputs);
      add(std::move(inputs));
      add(io_array(0x6421, "Analogue input interrupt trigger selection", "Trigger",
                   DataType::unsigned8, Access::rw, n, 4));
      add(io_single(0x6423, "Analogue input global interrupt enable", DataType::boolean,
                    Access::rw));
      const auto channels = [&](std::uint16_t index, const std::string& name,
                                const std::string& element, DataType type,
                                std::uint64_t value = 0) {
        add(io_array(index, "Analogue input " + name, element, type, Access::rw, n, value));
      };
      channels(0x6424, "interrupt upper limit integer", "Upper limit", DataType::integer32);
      channels(0x6425, "interrupt lower limit integer", "Lower limit", DataType::integer32);
      channels(0x6426, "interrupt delta unsigned", "Delta", DataType::unsigned32);
      channels(0x6427, "interrupt negative delta unsigned", "Negative delta", DataType::unsigned32);
      channels(0x6428, "interrupt positive delta unsigned", "Positive delta", DataType::unsigned32);
      channels(0x6431, "offset integer", "Offset", DataType::integer32);
      channels(0x6432, "scaling integer", "Scaling", DataType::integer32, 1);
    }
    if (const unsigned n = blocks_.analogue_outputs; n != 0) {
      ObjectDescription outputs = io_array(0x6411, "Write analogue output 16-bit",
                                           "Analogue output", DataType::integer16, Access::rww, n);
      make_mappable(outputs);
      add(std::move(outputs));
      add(io_array(0x6443, "Analogue output error mode", "Error mode", DataType::unsigned8,
                   Access::rw, n, 1));
      add(io_array(0x6444, "Analogue output error value integer", "Error value",
                   DataType::integer32, Access::rw, n));
      add(io_array(0x6446, "Analogue output offset integer", "Offset", DataType::integer32,
                   Access::rw, n));
      add(io_array(0x6447, "Analogue output scaling integer", "Scaling", DataType::integer32,
                   Access::rw, n, 1));
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
