// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/canopen_ia.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/bus_state.h"
#include "stack/diagnosis/record_description.h"

namespace linegate::diagnosis {
namespace {

using od::Access;
using od::DataType;

constexpr std::uint16_t kStatusRecord = 0x00;
constexpr std::uint16_t kControlRecord = 0x01;
constexpr std::uint16_t kNodeStates = 0x04;
constexpr std::uint16_t kNmtRecord = 0x0A;
constexpr std::uint16_t kFrameRecord = 0x0C;

constexpr std::uint8_t kSoftReset = 129;
constexpr std::uint8_t kHardReset = 130;

bool is_node(std::uint8_t id) {
  return id >= can::kMinNodeId && id <= can::kMaxNodeId;
}

od::ObjectDescription node_states(std::uint16_t index) {
  std::vector<od::VariableDescription> nodes;
  for (unsigned node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    nodes.push_back(od::number_variable(static_cast<std::uint8_t>(node),
                                        "Last known state of node " + std::to_string(node),
                                        DataType::unsigned8, Access::ro));
  }
  od::ObjectDescription out = record(index, "Status of all nodes", std::move(nodes));
  out.type = od::ObjectType::array;
  return out;
}

// The order that a written value stands for; nothing if it is not a command.
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

std::optional<CanopenIa::Order> order_of_scan(std::uint64_t value) {
  const auto node = static_cast<std::uint8_t>(value);
  if (!is_node(node)) {
    return std::nullopt;
  }
  return CanopenIa::Order{.node = node, .kind = CanopenIa::OrderKind::scan};
}

std::optional<CanopenIa::Order> order_of_trigger(std::uint64_t value) {
  const auto number = static_cast<std::uint8_t>(value & 0xFFU);
  const auto node = static_cast<std::uint8_t>(value >> 8U & 0xFFU);
  if (number == 0 || !is_node(node)) {
    return std::nullopt;
  }
  return CanopenIa::Order{.node = node, .kind = CanopenIa::OrderKind::trigger, .rpdo = number};
}

}  // namespace

Result<void> add_canopen_ia(od::Dictionary& dictionary, std::uint16_t base) {
  const auto at = [base](std::uint16_t offset) {
    return static_cast<std::uint16_t>(base + offset);
  };
  const od::ObjectDescription all[] = {
      record(at(kStatusRecord), "Device status",
             {od::number_variable(1, "Own node-ID", DataType::unsigned8, Access::ro),
              od::number_variable(2, "Own NMT state", DataType::unsigned8, Access::ro),
              od::number_variable(3, "Own hardware state", DataType::unsigned8, Access::ro),
              od::number_variable(4, "Own hardware and firmware", DataType::unsigned32, Access::ro),
              od::number_variable(5, "Serial number", DataType::domain, Access::ro)}),
      control_record(at(kControlRecord)),
      node_states(at(kNodeStates)),
      record(at(kNmtRecord), "NMT master message",
             {od::number_variable(1, "Transmit NMT", DataType::unsigned16, Access::wo)}),
      frame_record(at(kFrameRecord)),
  };
  for (const od::ObjectDescription& object : all) {
    if (const auto added = dictionary.add(object); !added) {
      return added;
    }
  }
  return {};
}

CanopenIa::CanopenIa(od::Dictionary& dictionary, const Diagnosis& diagnosis, RecordHost& host,
                     const CanopenIaOptions& options)
    : dictionary_(dictionary), diagnosis_(diagnosis), host_(host), options_(options) {
  set_hooks(this);
}

CanopenIa::~CanopenIa() {
  set_hooks(nullptr);
}

void CanopenIa::set_hooks(od::Hook* hook) {
  for (const std::uint16_t each :
       {kStatusRecord, kControlRecord, kNodeStates, kNmtRecord, kFrameRecord}) {
    LINEGATE_ASSERT(
        dictionary_.set_hook(static_cast<std::uint16_t>(options_.base + each), hook).ok(),
        "the object exists");
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
  if (offset(address) == kFrameRecord) {
    return read_frame(address);
  }
  if (address.sub == 0) {
    return AbortCode::none;
  }
  if (offset(address) == kNodeStates) {
    const auto status = diagnosis_.node_status().of(address.sub);
    return status ? give(*status) : AbortCode::no_data;
  }
  if (offset(address) == kControlRecord) {
    return give(read_setting(options_.settings, address.sub));
  }
  return read_status(address, variable);
}

AbortCode CanopenIa::read_status(od::Address address, const od::Variable& variable) {
  const auto give = [&variable](std::uint64_t value) {
    store_le(std::span(variable.data, variable.size), value);
    return AbortCode::none;
  };
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

AbortCode CanopenIa::read_frame(od::Address address) {
  if (address.sub == 0) {
    return AbortCode::none;
  }
  const std::span<const std::byte> value = heard_.last(address.sub);
  if (value.empty()) {
    return AbortCode::no_data;
  }
  (void)dictionary_.restore(address, value);
  return AbortCode::none;
}

std::uint8_t CanopenIa::hardware() const {
  const CommunicationState& bus = diagnosis_.communication_state();
  unsigned out = diagnosis_.own_state() == nmt::State::initialising ? 0U : kHardwareInitialised;
  out |= bus.errors() ? kHardwareErrors : 0U;
  out |= bus.bus() == can::BusState::error_passive ? kHardwarePassive : 0U;
  out |= bus.bus() == can::BusState::bus_off ? kHardwareBusOff : 0U;
  out |= (bus.value() & (kControllerOverrun | kReceiveOverrun)) != 0 ? kHardwareOverrun : 0U;
  const RecordHost::Transmission transmission = host_.transmission();
  out |= transmission.overrun ? kHardwareTransmitOverrun : 0U;
  out |= transmission.fd ? kHardwareFd : 0U;
  out |= transmission.waiting ? kHardwareTransmits : 0U;
  return static_cast<std::uint8_t>(out);
}

std::uint32_t CanopenIa::kind_and_version() const {
  constexpr std::uint32_t kManagerKind = 0x02;
  constexpr std::uint32_t kDeviceKind = 0x01;
  const std::uint32_t major = options_.revision >> 16U & 0xFFU;
  const std::uint32_t minor = options_.revision & 0xFFU;
  return (options_.manager ? kManagerKind : kDeviceKind) << 8U | major << 16U | minor << 24U;
}

bool CanopenIa::is_setting(od::Address address) const {
  return offset(address) == kControlRecord && address.sub != kResetSub && address.sub != kScanSub &&
         address.sub != kTriggerSub;
}

std::optional<CanopenIa::Order> CanopenIa::order_of(od::Address address,
                                                    std::uint64_t value) const {
  if (offset(address) == kNmtRecord) {
    return order_of_nmt(value);
  }
  switch (address.sub) {
    case kScanSub:
      return order_of_scan(value);
    case kTriggerSub:
      return order_of_trigger(value);
    default:
      return order_of_reset(value, options_.own_node);
  }
}

AbortCode CanopenIa::check_order(const Order& order) const {
  if (host_.sleeps()) {
    return AbortCode::device_state;
  }
  AbortCode why = AbortCode::none;
  if (order.kind == OrderKind::scan) {
    why = host_.may_scan(order.node);
  } else if (order.kind == OrderKind::trigger) {
    why = host_.may_trigger(order.node, order.rpdo);
  } else if (!options_.manager && order.node != options_.own_node) {
    why = AbortCode::local_control;
  }
  if (why != AbortCode::none) {
    return why;
  }
  return orders_.size() < kOrders ? AbortCode::none : AbortCode::device_state;
}

AbortCode CanopenIa::check_frame(od::Address address, std::span<const std::byte> value) const {
  if (!options_.settings.sends_frames) {
    return AbortCode::device_state;
  }
  const auto frame = frame_of(address.sub, value);
  return frame ? AbortCode::none : static_cast<AbortCode>(frame.error().code);
}

AbortCode CanopenIa::check_write(od::Address address, std::span<const std::byte> value) {
  if (offset(address) == kFrameRecord) {
    return check_frame(address, value);
  }
  const std::uint64_t number = load_le(value);
  if (is_setting(address)) {
    return check_setting(options_.settings, address.sub, number);
  }
  const auto order = order_of(address, number);
  return order ? check_order(*order) : AbortCode::invalid_value;
}

AbortCode CanopenIa::execute_write(od::Address address, std::span<const std::byte> value) {
  if (offset(address) == kFrameRecord) {
    const auto frame = frame_of(address.sub, value);
    return frame ? host_.transmit(*frame) : static_cast<AbortCode>(frame.error().code);
  }
  const std::uint64_t number = load_le(value);
  if (is_setting(address)) {
    write_setting(options_.settings, address.sub, number);
    pdo_times_written_ |= address.sub == kEventTimeSub || address.sub == kInhibitTimeSub;
    return AbortCode::none;
  }
  if (const auto order = order_of(address, number)) {
    orders_.push_back(*order);
  }
  return AbortCode::none;
}

}  // namespace linegate::diagnosis
