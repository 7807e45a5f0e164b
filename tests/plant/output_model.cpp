#include "tests/plant/output_model.h"

#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/nmt/node_control.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/parameters.h"

#include "tests/plant/world.h"

namespace linegate::plant {
namespace {

constexpr std::byte kToggle{0x80};  // of a guard answer
constexpr std::byte kOperational{0x05};

std::uint64_t bits_of(std::span<const std::byte> bytes, unsigned first, unsigned count) {
  std::uint64_t out = 0;
  for (unsigned i = 0; i < std::min(count, 64U); ++i) {
    const unsigned at = first + i;
    out |= std::uint64_t{std::to_integer<unsigned>(bytes[at / 8] >> (at % 8)) & 1U} << i;
  }
  return out;
}

// A heartbeat, guard answer or boot-up message.
bool is_state_message(const can::Frame& frame) {
  return (frame.id & ~std::uint32_t{can::kMaxNodeId}) == can::kErrorControlBase &&
         frame.standard_of(1);
}

// The first frame of a download by the default client.
bool starts_download(const can::Frame& frame) {
  return (frame.id & ~std::uint32_t{can::kMaxNodeId}) == can::kSdoRequestBase &&
         frame.standard_of(can::kMaxClassicData) &&
         (frame.data[0] & std::byte{0xE0}) == std::byte{0x20};
}

// As the device has it: its configuration may not be done yet.
bool is_synchronous(DeviceSeat& device, std::uint16_t rpdo) {
  const od::Address type{
      static_cast<std::uint16_t>(pdo::communication_base(pdo::PdoKind::rpdo) + rpdo - 1), 2};
  const auto value = device.device->dictionary().number(type);
  return value && pdo::is_synchronous(static_cast<std::uint8_t>(*value));
}

// An NMT command to that node, any but start.
bool ends_operational(const can::Frame& frame, std::uint8_t node) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  return control && control->command != nmt::Command::start &&
         (control->node == 0 || control->node == node);
}

bool is_operational(LineSeat& seat, const DeviceSeat& device) {
  return device.device->alive() && seat.bus.connected(device.end) &&
         device.device->node_id() == device.device->options().node_id &&
         device.device->node().state() == nmt::State::operational;
}

}  // namespace

OutputModel::OutputModel(const line::Line& line) {
  const image::Layout& layout = line.layout(image::Direction::outputs);
  for (const line::NodeConfig& node : line.config().nodes) {
    nodes_[node.id].guarded = node.guard_time != Duration::zero();
    const Loaded<pdo::DevicePdos> described = pdo::describe_pdos(node.device);
    for (const pdo::Parameters& rpdo : described.value->rpdos) {
      Pdo pdo{.node = node.id, .number = rpdo.number, .cob_id = rpdo.cob_id};
      unsigned position = 0;
      for (const pdo::Mapping& mapping : rpdo.mapping) {
        for (std::size_t i = 0; i < layout.entries.size(); ++i) {
          const image::Entry& entry = layout.entries[i];
          if (entry.node == node.id && entry.remote_pdo == rpdo.number &&
              od::Address{entry.index, entry.sub} == mapping.address) {
            pdo.fields.push_back({.entry = i,
                                  .address = mapping.address,
                                  .frame_bit = position,
                                  .image_bit = entry.bit_offset,
                                  .bits = entry.bit_length});
          }
        }
        position += mapping.bits;
      }
      if (!pdo.fields.empty()) {
        pdos_.push_back(std::move(pdo));
        ids_.push_back(node.id);
      }
    }
  }
  ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
}

void OutputModel::submitted(const can::Frame& frame) {
  for (const std::uint8_t id : ids_) {
    if (ends_operational(frame, id)) {
      withdraw(id);
    }
  }
  for (Pdo& pdo : pdos_) {
    if (frame.id == pdo.cob_id.id() && frame.extended() == pdo.cob_id.extended() &&
        !frame.remote()) {
      pdo.newest = frame;
      pdo.transmitted = true;
      ++pdo.under_way;
    }
  }
}

void OutputModel::ended(LineSeat& seat, const can::Frame& frame, sim::Bus::Endpoint sender,
                        sim::Fate fate) {
  const bool by_line = sender == seat.end;
  for (Pdo& pdo : pdos_) {
    if (frame.id == pdo.cob_id.id() && frame.extended() == pdo.cob_id.extended() &&
        !frame.remote()) {
      pdo_ended(seat, pdo, by_line, fate);
    }
  }
  if (fate == sim::Fate::lost || fate == sim::Fate::disturbed || frame.extended()) {
    return;
  }
  for (const std::uint8_t id : ids_) {
    if (by_line && ends_operational(frame, id)) {
      nodes_[id].commanded = true;
      nodes_[id].unnoticed = false;
    }
  }
  if (frame.id == can::kSyncId && frame.length <= 1) {
    for (Pdo& pdo : pdos_) {
      pdo.awaits_sync = false;
    }
  } else if (is_state_message(frame)) {
    state_ended(seat, frame);
  } else if (starts_download(frame)) {
    const od::Address address{load_le<std::uint16_t>(frame.data.data() + 1),
                              std::to_integer<std::uint8_t>(frame.data[3])};
    for (Pdo& pdo : pdos_) {
      pdo.written_by_others |=
          pdo.node == (frame.id & can::kMaxNodeId) &&
          std::ranges::any_of(pdo.fields, [&](const Field& f) { return f.address == address; });
    }
  }
}

void OutputModel::state_ended(LineSeat& seat, const can::Frame& frame) {
  const auto id = static_cast<std::uint8_t>(frame.id & can::kMaxNodeId);
  Node& node = nodes_[id];
  const bool boot_up = frame.data[0] == std::byte{0};
  const std::byte toggle = frame.data[0] & kToggle;
  const bool repeated = node.guarded && !boot_up && toggle == node.toggle;
  node.toggle = boot_up ? kToggle : toggle;
  if (!repeated && (frame.data[0] & ~kToggle) != kOperational) {
    withdraw(id);
    node.unnoticed = false;
  } else if (const DeviceSeat* const device = seat.find(id)) {
    node.unnoticed |= !device->device->alive();
  }
}

void OutputModel::pdo_ended(LineSeat& seat, Pdo& pdo, bool by_line, sim::Fate fate) {
  if (fate == sim::Fate::disturbed) {
    return;
  }
  if (!by_line) {
    pdo.written_by_others |= fate != sim::Fate::lost;
    return;
  }
  pdo.under_way -= fate == sim::Fate::doubled ? 0U : 1U;
  pdo.lost = fate == sim::Fate::lost;
  if (pdo.lost) {
    return;
  }
  pdo.written_by_others = false;
  DeviceSeat* const device = seat.find(pdo.node);
  pdo.awaits_sync = device != nullptr && is_synchronous(*device, pdo.number);
  pdo.unconfirmed =
      device != nullptr && !is_operational(seat, *device) && !nodes_[pdo.node].confirmed;
}

void OutputModel::withdraw(std::uint8_t node) {
  for (Pdo& pdo : pdos_) {
    if (pdo.node == node) {
      pdo.transmitted = false;
    }
  }
}

void OutputModel::look_at(LineSeat& seat, std::uint8_t id) {
  Node& node = nodes_[id];
  const line::NodeState said = seat.line->node_state(id);
  node.shown = said.presence == line::Presence::present && said.state == nmt::State::operational;
  node.confirmed = said.cause != line::StateCause::command || said.heartbeat_monitored;
  if (const DeviceSeat* const device = seat.find(id)) {
    const bool operational = is_operational(seat, *device);
    node.unnoticed |= node.operational && !operational && !node.commanded;
    node.operational = operational;
    node.commanded = false;
  }
  if (!node.shown) {
    node.unnoticed = false;
    withdraw(id);
  }
}

std::string OutputModel::compare(LineSeat& seat, Instant now) {
  if (pdos_.empty()) {
    return {};
  }
  for (const std::uint8_t id : ids_) {
    look_at(seat, id);
  }
  seat.line->snapshot(image::Direction::outputs, snapshot_, now, true);

  for (Pdo& pdo : pdos_) {
    if (std::string text = compare(seat, pdo); !text.empty()) {
      return text;
    }
  }
  return {};
}

std::string OutputModel::compare(LineSeat& seat, Pdo& pdo) {
  const image::Layout& layout = seat.line->layout(image::Direction::outputs);
  for (const Field& field : pdo.fields) {
    if (!snapshot_.is_valid(field.entry)) {
      continue;
    }
    const std::string name = layout.entries[field.entry].name + " is valid ";
    if (!nodes_[pdo.node].shown) {
      return name + "although its node is not shown as Operational";
    }
    if (!pdo.transmitted) {
      return name + "although its PDO was not transmitted since the start of its node";
    }
    const std::uint64_t shown = bits_of(snapshot_.bytes, field.image_bit, field.bits);
    const std::uint64_t sent = bits_of(pdo.newest.data, field.frame_bit, field.bits);
    if (sent != shown) {
      return name + "with " + std::to_string(shown) + ", its PDO carried " + std::to_string(sent);
    }
    const bool excepted = pdo.under_way != 0 || pdo.awaits_sync || pdo.lost ||
                          pdo.written_by_others || pdo.unconfirmed || nodes_[pdo.node].unnoticed;
    if (std::string text = excepted ? std::string() : compare_device(seat, field, shown, pdo.node);
        !text.empty()) {
      return name + text;
    }
  }
  return {};
}

std::string OutputModel::compare_device(LineSeat& seat, const Field& field, std::uint64_t shown,
                                        std::uint8_t node) {
  DeviceSeat* const device = seat.find(node);
  if (device == nullptr) {
    return {};
  }
  ++compared_;
  const auto number = device->device->dictionary().number(field.address);
  const std::uint64_t mask =
      field.bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << field.bits) - 1;
  const std::uint64_t real = number.value_or(0) & mask;
  return real == shown
             ? std::string()
             : "with " + std::to_string(shown) + ", the device has " + std::to_string(real);
}

}  // namespace linegate::plant
