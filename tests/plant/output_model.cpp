// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/output_model.h"

#include <algorithm>
#include <iomanip>
#include <optional>
#include <sstream>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/nmt/node_control.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

#include "tests/plant/output_fields.h"
#include "tests/plant/usdo_fields.h"
#include "tests/plant/world.h"

namespace linegate::plant {
namespace {

constexpr std::byte kToggle{0x80};  // toggle bit of a guard response
constexpr std::byte kOperational{0x05};
constexpr unsigned kSigns = 3;  // the first ones may have been under way when the node was reset
constexpr Duration kUnwatched = std::chrono::milliseconds(100);
// Longer than the time between two requests of a boot process: 1000h is requested again one second
// after the SDO time-out (CiA 302-2 figure 4).
constexpr Duration kBootPause = std::chrono::seconds(2);
// Boot status (CiA 302-2)
constexpr char kNotConfigured = 'J';
constexpr char kNoErrorControl = 'K';  // the node is configured

// A heartbeat, guard response or boot-up message with a valid state. A node in Initialising answers
// no guarding, so 80h is none.
bool is_state_message(const can::Frame& frame) {
  constexpr std::array kStates{0x00, 0x04, 0x05, 0x7F};
  const auto is_said = [&frame](int state) {
    return (frame.data[0] & std::byte{0x7F}) == std::byte(state);
  };
  return (frame.id & ~std::uint32_t{can::kMaxNodeId}) == can::kErrorControlBase &&
         frame.standard_of(1) && frame.data[0] != std::byte{0x80} &&
         std::ranges::any_of(kStates, is_said);
}

bool is_boot_up(const can::Frame& frame) {
  return is_state_message(frame) && frame.data[0] == std::byte{0};
}

// An object that a request begins to write, and its node.
struct Written {
  std::uint8_t node = 0;
  od::Address object;
};

// By the default client, or by a USDO client. Empty for other frames.
std::optional<Written> written_by(const can::Frame& frame) {
  if (begins_usdo_download(frame)) {
    return Written{usdo_receiver(frame), usdo_object(frame)};
  }
  const bool starts = (frame.id & ~std::uint32_t{can::kMaxNodeId}) == can::kSdoRequestBase &&
                      frame.standard_of(can::kMaxClassicData) &&
                      (frame.data[0] & std::byte{0xE0}) == std::byte{0x20};
  if (!starts) {
    return std::nullopt;
  }
  return Written{static_cast<std::uint8_t>(frame.id & can::kMaxNodeId),
                 {load_le<std::uint16_t>(frame.data.data() + 1),
                  std::to_integer<std::uint8_t>(frame.data[3])}};
}

// A request by SDO or USDO to that node.
bool is_request_to(const can::Frame& frame, std::uint8_t node) {
  return is_usdo(frame, can::kSdoRequestBase)
             ? usdo_receiver(frame) == node
             : frame.standard_of(can::kMaxClassicData) && frame.id == can::kSdoRequestBase + node;
}

// The first request of a boot process: the device type (CiA 302-2 figure 4).
bool requests_device_type(const can::Frame& frame) {
  constexpr std::uint16_t kDeviceType = 0x1000;
  if (frame.fd()) {
    return usdo_command(frame) == kUsdoUpload && usdo_object(frame).index == kDeviceType;
  }
  return frame.data[0] == std::byte{0x40} &&
         load_le<std::uint16_t>(frame.data.data() + 1) == kDeviceType;
}

// Up to the last byte that is not 0.
std::string values_text(const PdoValues& values) {
  std::ostringstream out;
  out << std::hex << std::uppercase << std::setfill('0');
  std::size_t count = can::kMaxFdData;
  const auto byte = [&values](std::size_t at) { return values[at / 8] >> (at % 8 * 8) & 0xFFU; };
  while (count > 1 && byte(count - 1) == 0) {
    --count;
  }
  for (std::size_t i = 0; i < count; ++i) {
    out << std::setw(2) << byte(i);
  }
  return out.str();
}

// Uses the dictionary of the device, whose configuration may not be complete yet.
bool is_synchronous(DeviceSeat& device, std::uint16_t rpdo) {
  const od::Address type{
      static_cast<std::uint16_t>(pdo::communication_base(pdo::PdoKind::rpdo) + rpdo - 1), 2};
  const auto value = device.device->dictionary().number(type);
  return value && pdo::is_synchronous(static_cast<std::uint8_t>(*value));
}

// An NMT command to that node, any except start.
bool ends_operational(const can::Frame& frame, std::uint8_t node) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  return control && control->command != nmt::Command::start &&
         (control->node == 0 || control->node == node);
}

bool resets_node(const can::Frame& frame, std::uint8_t node) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  return control && nmt::is_reset(control->command) && control->addresses(node);
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
    nodes_[node.id].period = std::max(node.heartbeat, node.guard_time);
    const Loaded<pdo::DevicePdos> described = pdos_in(node.device, line.config().canopen_fd);
    for (const pdo::Parameters& rpdo : described.value->rpdos) {
      Pdo pdo{.node = node.id,
              .number = rpdo.number,
              .cob_id = rpdo.cob_id,
              .type = rpdo.type,
              .inhibit = pdo::is_synchronous(rpdo.type) ? Duration{} : rpdo.inhibit};
      each_output(layout, node.id, rpdo, [&](std::size_t i, od::Address object, unsigned bit) {
        pdo.fields.push_back({.entry = i,
                              .address = object,
                              .frame_bit = bit,
                              .image_bit = layout.entries[i].bit_offset,
                              .bits = layout.entries[i].bit_length});
      });
      if (!pdo.fields.empty()) {
        pdos_.push_back(std::move(pdo));
        ids_.push_back(node.id);
      }
    }
  }
  ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
}

void OutputModel::commanded(LineSeat& seat, const line::Command& command) {
  const auto* const control = std::get_if<line::NmtRequest>(&command.request);
  const bool ends = control != nullptr && control->command != nmt::Command::start;
  for (const std::uint8_t id : ids_) {
    if (ends && (control->node == 0 || control->node == id) &&
        seat.line->state().role == line::Role::manager) {
      nodes_[id].signs = 0;
    }
  }
}

void OutputModel::submitted(LineSeat& seat, const can::Frame& frame, Instant now) {
  if (frame.id == can::kSyncId && frame.length <= 1) {
    ++syncs_;
    sync_waits_ = false;
    hand_out_sync(seat, now);
  }
  ++submitted_;
  for (const std::uint8_t id : ids_) {
    if (ends_operational(frame, id)) {
      nodes_[id].end = submitted_;
      withdraw(id);
    }
    follow_boot(frame, id, now);
  }
  // After its reset the own node counts SYNC messages anew, and a SYNC from before may wait.
  const bool own_boot_up = frame.id == can::kErrorControlBase + seat.line->config().node_id &&
                           frame.length == 1 && frame.data[0] == std::byte{0};
  for (Pdo& pdo : pdos_) {
    if (own_boot_up) {
      pdo.due_at = kNever;
    }
    if (frame.id == pdo.cob_id.id() && frame.extended() == pdo.cob_id.extended() &&
        !frame.remote()) {
      check_order(seat, pdo, frame, now);
      pdo.newest = frame;
      pdo.free_at = now + pdo.inhibit;
      pdo.transmitted = true;
      pdo.under_way.push_back(true);
    }
  }
}

// PDOs for a SYNC that waited for the bus are sampled when that SYNC is submitted.
void OutputModel::hand_out_sync(LineSeat& seat, Instant now) {
  if (now <= passed_at_) {
    return;
  }
  seat.line->snapshot(image::Direction::outputs, snapshot_, now, true);
  for (Pdo& pdo : pdos_) {
    pdo.at_sync = values(pdo);
    pdo.before_sync = pdo.at_sync;
  }
}

// A boot process begins with the reset of the node, its boot-up message or the request for 1000h,
// and has no longer pause. After a boot-up message the request may wait for an SDO transfer that
// the node no longer answers, because the channel has one transfer at a time.
void OutputModel::follow_boot(const can::Frame& frame, std::uint8_t id, Instant now) {
  Node& node = nodes_[id];
  const bool boots = node.boots_at != Instant{} && now - node.boots_at < kBootPause;
  if (resets_node(frame, id)) {
    node.boots_at = now;
  } else if (is_request_to(frame, id)) {
    node.boots_at = boots || requests_device_type(frame) ? now : Instant{};
  }
}

// Clause 6. Changes by the call that processed SYNC, such as the reaction of a watchdog, may be in
// the sample or not.
void OutputModel::check_order(LineSeat& seat, const Pdo& pdo, const can::Frame& frame,
                              Instant now) {
  seat.line->snapshot(image::Direction::outputs, snapshot_, now, true);
  const PdoValues has = carried(pdo, frame);
  const bool newest = pdo::is_synchronous(pdo.type) ? has == pdo.at_sync || has == pdo.before_sync
                                                    : has == values(pdo);
  if (!newest && older_.empty()) {
    older_ = "a frame of RPDO " + std::to_string(pdo.number) + " of node " +
             std::to_string(pdo.node) + " has " + values_text(has) + " instead of the newest " +
             values_text(pdo::is_synchronous(pdo.type) ? pdo.at_sync : values(pdo));
  }
}

void OutputModel::look_at_sync(LineSeat& seat, Instant now, bool advanced) {
  const auto is_one = [](const Pdo& pdo) { return pdo::is_synchronous(pdo.type); };
  if (!std::ranges::any_of(pdos_, is_one)) {
    return;
  }
  seat.line->snapshot(image::Direction::outputs, snapshot_, now, true);
  const bool passed = std::exchange(passed_, seat.line->sync_count()) != passed_;
  sync_waits_ |= passed && advanced;
  passed_at_ = passed ? now : passed_at_;
  for (Pdo& pdo : pdos_) {
    const PdoValues before = std::exchange(pdo.latest, values(pdo));
    if (passed) {
      pdo.before_sync = before;
      pdo.at_sync = pdo.latest;
    }
  }
}

// The values of the image in the form of a frame.
PdoValues OutputModel::values(const Pdo& pdo) const {
  PdoValues out{};
  for (const Field& field : pdo.fields) {
    put_bits(out, field.frame_bit, field.bits,
             bits_of(snapshot_.bytes, field.image_bit, field.bits));
  }
  return out;
}

PdoValues OutputModel::carried(const Pdo& pdo, const can::Frame& frame) {
  PdoValues out{};
  for (const Field& field : pdo.fields) {
    put_bits(out, field.frame_bit, field.bits, bits_of(frame.data, field.frame_bit, field.bits));
  }
  return out;
}

void OutputModel::acknowledged(std::uint64_t number) {
  for (const std::uint8_t id : ids_) {
    Node& node = nodes_[id];
    if (node.end != 0 && node.end <= number) {
      node.end = 0;
      node.signs = 0;
    }
  }
}

void OutputModel::flushed() {
  for (Pdo& pdo : pdos_) {
    pdo.transmitted = pdo.transmitted && pdo.under_way.empty();
    pdo.under_way.clear();
  }
}

void OutputModel::submitted_by_device(const can::Frame& frame) {
  if (is_boot_up(frame)) {
    Node& node = nodes_[frame.id & can::kMaxNodeId];
    ++node.boot_ups_waiting;
    node.restarted_unheard = true;
  }
}

void OutputModel::ended(LineSeat& seat, const can::Frame& frame, sim::Bus::Endpoint sender,
                        sim::Fate fate) {
  const bool by_line = sender == seat.end;
  for (Pdo& pdo : pdos_) {
    if (frame.id == pdo.cob_id.id() && frame.extended() == pdo.cob_id.extended() &&
        !frame.remote()) {
      pdo_ended(seat, pdo, frame, by_line, fate);
    }
  }
  // Whether the line received the frame
  const bool received = fate != sim::Fate::lost && (by_line || seat.bus.connected(seat.end));
  if (fate != sim::Fate::disturbed && is_boot_up(frame)) {
    Node& node = nodes_[frame.id & can::kMaxNodeId];
    const unsigned later = node.boot_ups_waiting > 0 ? node.boot_ups_waiting - 1 : 0U;
    node.restarted_unheard = !received || later > 0;
    if (fate != sim::Fate::doubled) {
      node.boot_ups_waiting = later;
    }
  }
  if (fate == sim::Fate::lost || fate == sim::Fate::disturbed || frame.extended()) {
    return;
  }
  for (const std::uint8_t id : ids_) {
    if (received) {
      follow_command(frame, id);
    }
    if (by_line && ends_operational(frame, id)) {
      nodes_[id].commanded = true;
      nodes_[id].unnoticed = false;
    }
  }
  if (frame.id == can::kSyncId && frame.length <= 1) {
    for (Pdo& pdo : pdos_) {
      pdo.awaits_sync = false;
    }
  } else if (is_state_message(frame) && received) {
    state_ended(seat, frame);
  } else if (const auto written = written_by(frame)) {
    for (Pdo& pdo : pdos_) {
      pdo.written_by_others |=
          pdo.node == written->node && std::ranges::any_of(pdo.fields, [&](const Field& f) {
            return f.address == written->object;
          });
    }
  }
}

// Whoever ends Operational: values sent before do not count, and later ones need not be sent before
// the node has shown that it is Operational. A device without error control does not show that it
// was started.
void OutputModel::follow_command(const can::Frame& frame, std::uint8_t id) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  if (!control || (control->node != 0 && control->node != id)) {
    return;
  }
  Node& node = nodes_[id];
  const bool starts = control->command == nmt::Command::start;
  if (!starts || !node.shown) {
    forget_frames(id);
  }
  if (!starts || node.period == Duration::zero()) {
    node.signs = starts ? kSigns : 0;
  }
}

void OutputModel::state_ended(LineSeat& seat, const can::Frame& frame) {
  const auto id = static_cast<std::uint8_t>(frame.id & can::kMaxNodeId);
  Node& node = nodes_[id];
  const bool boot_up = frame.data[0] == std::byte{0};
  const std::byte toggle = frame.data[0] & kToggle;
  const bool repeated = node.guarded && !boot_up && toggle == node.toggle;
  node.toggle = boot_up ? kToggle : toggle;
  node.booted_now |= boot_up;
  if (!repeated && (frame.data[0] & ~kToggle) != kOperational) {
    withdraw(id);
    node.unnoticed = false;
  } else if (const DeviceSeat* const device = seat.find(id)) {
    node.unnoticed |= !is_operational(seat, *device);
    node.signed_now |= !repeated;
  }
}

void OutputModel::pdo_ended(LineSeat& seat, Pdo& pdo, const can::Frame& frame, bool by_line,
                            sim::Fate fate) {
  if (fate == sim::Fate::disturbed) {
    return;
  }
  if (!by_line) {
    pdo.written_by_others |= fate != sim::Fate::lost;
    note_shared(pdo, pdo.acknowledged);
    return;
  }
  if (fate != sim::Fate::doubled && !pdo.under_way.empty()) {
    pdo.acknowledged = frame;
    pdo.is_acknowledged = pdo.under_way.front();
    pdo.under_way.pop_front();
  }
  pdo.lost = fate == sim::Fate::lost;
  if (pdo.lost) {
    return;
  }
  pdo.written_by_others = false;
  for (Field& field : pdo.fields) {
    field.overwritten = false;
  }
  note_shared(pdo, frame);
  DeviceSeat* const device = seat.find(pdo.node);
  pdo.awaits_sync = device != nullptr && is_synchronous(*device, pdo.number);
  pdo.unconfirmed =
      device != nullptr && !is_operational(seat, *device) && !nodes_[pdo.node].confirmed;
}

// A frame of the PDO ended, perhaps one that is repeated and not yet acknowledged: the other RPDOs
// that carry one of its objects, with another value, no longer show what the device has. A
// synchronous one that waits for SYNC is processed after it.
void OutputModel::note_shared(Pdo& pdo, const can::Frame& frame) {
  for (Pdo& other : pdos_) {
    if (&other == &pdo || other.node != pdo.node) {
      continue;
    }
    for (Field& field : pdo.fields) {
      const auto same = std::ranges::find(other.fields, field.address, &Field::address);
      if (same == other.fields.end()) {
        continue;
      }
      const std::uint64_t has = bits_of(frame.data, field.frame_bit, field.bits);
      const bool differs = pdo.written_by_others ||
                           has != bits_of(other.acknowledged.data, same->frame_bit, same->bits);
      same->overwritten |= differs;
      field.overwritten |= differs && other.awaits_sync;
    }
  }
}

void OutputModel::withdraw(std::uint8_t node) {
  nodes_[node].signs = 0;
  forget_frames(node);
}

// Frames submitted to the node before no longer count.
void OutputModel::forget_frames(std::uint8_t node) {
  for (Pdo& pdo : pdos_) {
    if (pdo.node == node) {
      pdo.transmitted = false;
      pdo.is_acknowledged = false;
      std::ranges::fill(pdo.under_way, false);
      pdo.due_at = kNever;
    }
  }
}

bool OutputModel::is_to_boot(const LineSeat& seat, std::uint8_t id) {
  const auto& nodes = seat.line->config().nodes;
  const auto found = std::ranges::find(nodes, id, &line::NodeConfig::id);
  return found != nodes.end() && found->boot;
}

// The line is an active manager. A state of the line costs more than a step of a small plant.
bool OutputModel::manages(const line::Line& line) {
  const manager::ManagerState state = line.state().manager;
  return state != manager::ManagerState::inactive && state != manager::ManagerState::stopped;
}

void OutputModel::look_at(LineSeat& seat, std::uint8_t id) {
  Node& node = nodes_[id];
  const line::NodeState said = seat.line->node_state(id);
  node.shown = said.presence == line::Presence::present && said.state == nmt::State::operational;
  node.confirmed = said.cause != line::StateCause::command || said.heartbeat_monitored;
  // Also a line that has given up its role holds the PDOs back of which it knows that they differ.
  const bool is_refused =
      said.boot == kNotConfigured && od::objects::is_pdo_record(said.finding.object.index);
  node.other_pdos = node.shown && !manager::is_booted(said.boot) && said.boot != kNoErrorControl &&
                    is_to_boot(seat, id) && (is_refused || manages(*seat.line));
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
    Node& node = nodes_[id];
    // A controller without a bus transmits all signs of that time together: they count as one.
    if (std::exchange(node.signed_now, false) && now - node.signed_at >= node.period / 2) {
      ++node.signs;
      node.signed_at = now;
    }
    node.boots_at = std::exchange(node.booted_now, false) ? now : node.boots_at;
  }
  seat.line->snapshot(image::Direction::outputs, snapshot_, now, true);

  for (Pdo& pdo : pdos_) {
    if (std::string text = compare(seat, pdo); !text.empty()) {
      return text;
    }
    if (std::string text = check_due(seat, pdo, now); !text.empty()) {
      return text;
    }
  }
  return older_;
}

// The number of submitted SYNC messages when the wanted values are due. Changes by the call that
// processed the waiting SYNC may be in its sample or not.
std::uint32_t OutputModel::due_sync_of(const Pdo& pdo) const {
  const std::uint32_t cycle = std::max<std::uint32_t>(pdo.type, 1);
  const bool contains = pdo.at_sync == pdo.wanted && pdo.before_sync == pdo.wanted;
  return syncs_ + cycle + (sync_waits_ && !contains ? 1U : 0U);
}

// Clauses 4 and 5.
std::string OutputModel::check_due(LineSeat& seat, Pdo& pdo, Instant now) {
  const Node& node = nodes_[pdo.node];
  const bool boots = node.boots_at != Instant{} && now - node.boots_at < kBootPause &&
                     seat.line->node_state(pdo.node).boot == manager::kBootUnfinished;
  bool complete = node.shown && !node.other_pdos && !seat.stopped && !boots &&
                  seat.line->indicators().run == node::Pattern::on && seat.bus.connected(seat.end);
  for (const Field& field : pdo.fields) {
    complete &= snapshot_.is_known(field.entry);
  }
  const PdoValues wanted = values(pdo);
  const bool started = pdo.transmitted || (node.end == 0 && node.signs >= kSigns);
  if (!complete || !started || (pdo.transmitted && wanted == carried(pdo, pdo.newest))) {
    pdo.due_at = kNever;
    return {};
  }
  if (pdo.due_at == kNever || pdo.wanted != wanted) {
    pdo.due_at = now + (pdo.transmitted ? Duration{} : kUnwatched);
    pdo.wanted = wanted;
    pdo.due_sync = due_sync_of(pdo);
  }
  if (now < pdo.due_at) {
    pdo.due_sync = due_sync_of(pdo);
    return {};
  }
  const bool allowed = pdo::is_synchronous(pdo.type) ? syncs_ >= pdo.due_sync : now >= pdo.free_at;
  if (!allowed || seat.bus.room(seat.end) == 0) {
    return {};
  }
  return "RPDO " + std::to_string(pdo.number) + " of node " + std::to_string(pdo.node) +
         (pdo.transmitted ? " has a new value and is not transmitted"
                          : " was not transmitted since the start of the node");
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
    if (nodes_[pdo.node].other_pdos) {
      return name + "although its node is not booted";
    }
    if (!pdo.is_acknowledged) {
      return name + "although its PDO was not acknowledged since the start of its node";
    }
    const std::uint64_t shown = bits_of(snapshot_.bytes, field.image_bit, field.bits);
    const std::uint64_t sent = bits_of(pdo.acknowledged.data, field.frame_bit, field.bits);
    if (sent != shown) {
      return name + "with " + std::to_string(shown) + ", its PDO carried " + std::to_string(sent);
    }
    const bool excepted = !pdo.under_way.empty() || pdo.awaits_sync || pdo.lost ||
                          pdo.written_by_others || field.overwritten || pdo.unconfirmed ||
                          nodes_[pdo.node].unnoticed ||
                          (nodes_[pdo.node].restarted_unheard &&
                           (!nodes_[pdo.node].confirmed || nodes_[pdo.node].guarded));
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
