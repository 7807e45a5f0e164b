#include "stack/diagnosis/canopen_ia.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/bus_state.h"

namespace linegate::diagnosis {
namespace {

using od::Access;
using od::DataType;

constexpr std::uint16_t kStatusRecord = 0x00;
constexpr std::uint16_t kControlRecord = 0x01;
constexpr std::uint16_t kNodeStates = 0x04;
constexpr std::uint16_t kNmtRecord = 0x0A;

constexpr std::uint8_t kResetSub = 1;
constexpr std::uint8_t kManagerControl = 4;
constexpr std::uint8_t kSoftReset = 129;
constexpr std::uint8_t kHardReset = 130;

od::VariableDescription member(std::uint8_t sub, std::string name, DataType type, Access access,
                               std::uint64_t value = 0) {
  od::VariableDescription out;
  out.sub = sub;
  out.name = std::move(name);
  out.type = type;
  out.access = access;
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

od::ObjectDescription record(std::uint16_t index, std::string name,
                             std::vector<od::VariableDescription> members) {
  od::ObjectDescription out{
      .index = index, .name = std::move(name), .type = od::ObjectType::record};
  out.variables = std::move(members);
  const std::uint8_t highest = out.variables.back().sub;
  out.variables.insert(out.variables.begin(), member(0, "Highest sub-index", DataType::unsigned8,
                                                     Access::constant, highest));
  return out;
}

od::ObjectDescription node_states(std::uint16_t index) {
  std::vector<od::VariableDescription> nodes;
  for (unsigned node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    nodes.push_back(member(static_cast<std::uint8_t>(node),
                           "Last known state of node " + std::to_string(node), DataType::unsigned8,
                           Access::ro));
  }
  od::ObjectDescription out = record(index, "Status of all nodes", std::move(nodes));
  out.type = od::ObjectType::array;
  return out;
}

// What a write of the two objects that order something says; nothing if it is no command.
std::optional<CanopenIa::Order> order_of_reset(std::uint64_t value, std::uint8_t own) {
  switch (value) {
    case kSoftReset:
      return CanopenIa::Order{nmt::Command::reset_communication, own};
    case kHardReset:
      return CanopenIa::Order{nmt::Command::reset_node, own};
    default:
      return std::nullopt;
  }
}

std::optional<CanopenIa::Order> order_of_nmt(std::uint64_t value) {
  const auto command = static_cast<std::uint8_t>(value & 0xFFU);
  const auto node = static_cast<std::uint8_t>(value >> 8U & 0xFFU);
  if (!nmt::is_command(command) || node > can::kMaxNodeId) {
    return std::nullopt;
  }
  return CanopenIa::Order{static_cast<nmt::Command>(command), node};
}

}  // namespace

Result<void> add_canopen_ia(od::Dictionary& dictionary, std::uint16_t base) {
  const auto at = [base](std::uint16_t offset) {
    return static_cast<std::uint16_t>(base + offset);
  };
  const od::ObjectDescription all[] = {
      record(at(kStatusRecord), "Device status",
             {member(1, "Own node-ID", DataType::unsigned8, Access::ro),
              member(2, "Own NMT state", DataType::unsigned8, Access::ro),
              member(3, "Own hardware state", DataType::unsigned8, Access::ro),
              member(4, "Own hardware and firmware", DataType::unsigned32, Access::ro),
              member(5, "Serial number", DataType::domain, Access::ro)}),
      record(at(kControlRecord), "Device control",
             {member(kResetSub, "Reset", DataType::unsigned8, Access::wo),
              member(kManagerControl, "Manager control", DataType::unsigned32, Access::rw)}),
      node_states(at(kNodeStates)),
      record(at(kNmtRecord), "NMT master message",
             {member(1, "Transmit NMT", DataType::unsigned16, Access::wo)}),
  };
  for (const od::ObjectDescription& object : all) {
    if (const auto added = dictionary.add(object); !added) {
      return added;
    }
  }
  return {};
}

CanopenIa::CanopenIa(od::Dictionary& dictionary, const Diagnosis& diagnosis,
                     const CanopenIaOptions& options)
    : dictionary_(dictionary),
      diagnosis_(diagnosis),
      options_(options),
      keep_operational_(options.keep_operational) {
  set_hooks(this);
}

CanopenIa::~CanopenIa() {
  set_hooks(nullptr);
}

void CanopenIa::set_hooks(od::Hook* hook) {
  for (const std::uint16_t each : {kStatusRecord, kControlRecord, kNodeStates, kNmtRecord}) {
    (void)dictionary_.set_hook(static_cast<std::uint16_t>(options_.base + each), hook).ok();
  }
}

bool CanopenIa::take(Order& out) {
  if (orders_.empty()) {
    return false;
  }
  out = orders_.front();
  orders_.pop_front();
  return true;
}

AbortCode CanopenIa::before_read(od::Address address, const od::Variable& variable) {
  const auto give = [&variable](std::uint64_t value) {
    store_le(std::span(variable.data, variable.size), value);
    return AbortCode::none;
  };
  if (address.sub == 0) {
    return AbortCode::none;
  }
  if (offset(address) == kNodeStates) {
    const auto status = diagnosis_.node_status().of(address.sub);
    return status ? give(*status) : AbortCode::no_data;
  }
  if (offset(address) == kControlRecord) {
    return give(control());
  }
  switch (address.sub) {
    case 1:
      return give(options_.own_node);
    case 2:
      return give(static_cast<std::uint8_t>(diagnosis_.own_state()));
    case 3:
      return give(hardware());
    case 4:
      return give(kind_and_version());
    default:
      break;
  }
  std::array<std::byte, 16> serial{};
  store_le(serial.data(), options_.serial);
  (void)dictionary_.restore(address, serial);
  return AbortCode::none;
}

std::uint8_t CanopenIa::hardware() const {
  const CommunicationState& bus = diagnosis_.communication_state();
  unsigned out = diagnosis_.own_state() == nmt::State::initialising ? 0U : kHardwareInitialised;
  out |= bus.errors() ? kHardwareErrors : 0U;
  out |= bus.bus() == can::BusState::error_passive ? kHardwarePassive : 0U;
  out |= bus.bus() == can::BusState::bus_off ? kHardwareBusOff : 0U;
  out |= (bus.value() & (kControllerOverrun | kReceiveOverrun)) != 0 ? kHardwareOverrun : 0U;
  return static_cast<std::uint8_t>(out);
}

std::uint32_t CanopenIa::kind_and_version() const {
  constexpr std::uint32_t kManagerKind = 0x02;
  constexpr std::uint32_t kDeviceKind = 0x01;
  const std::uint32_t major = options_.revision >> 16U & 0xFFU;
  const std::uint32_t minor = options_.revision & 0xFFU;
  return (options_.manager ? kManagerKind : kDeviceKind) << 8U | major << 16U | minor << 24U;
}

std::uint32_t CanopenIa::control() const {
  return kFixedControl | (keep_operational_ ? kKeepOperational : 0U);
}

AbortCode CanopenIa::check_order(const Order& order) const {
  if (!options_.manager && order.node != options_.own_node) {
    return AbortCode::local_control;
  }
  return orders_.size() < kOrders ? AbortCode::none : AbortCode::device_state;
}

AbortCode CanopenIa::check_write(od::Address address, std::span<const std::byte> value) {
  const std::uint64_t number = load_le(value);
  if (offset(address) == kControlRecord && address.sub == kManagerControl) {
    return (number | kKeepOperational) == (control() | kKeepOperational) ? AbortCode::none
                                                                         : AbortCode::invalid_value;
  }
  const auto order = offset(address) == kControlRecord ? order_of_reset(number, options_.own_node)
                                                       : order_of_nmt(number);
  return order ? check_order(*order) : AbortCode::invalid_value;
}

AbortCode CanopenIa::execute_write(od::Address address, std::span<const std::byte> value) {
  const std::uint64_t number = load_le(value);
  if (offset(address) == kControlRecord && address.sub == kManagerControl) {
    keep_operational_ = (number & kKeepOperational) != 0;
    return AbortCode::none;
  }
  const auto order = offset(address) == kControlRecord ? order_of_reset(number, options_.own_node)
                                                       : order_of_nmt(number);
  if (order) {
    orders_.push_back(*order);
  }
  return AbortCode::none;
}

}  // namespace linegate::diagnosis
