// SPDX-License-Identifier: Apache-2.0
#include "stack/line/virtual_device.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/line/own_objects.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/profile/io_device.h"
#include "stack/time/message.h"
#include "stack/time/service.h"

namespace linegate::line {
namespace {

using image::Direction;

constexpr std::uint64_t kProfileOf1000h = 0xFFFF;

// The LSS address of a device must not depend on its node-ID.
void keep_identity(od::DeviceDescription& device) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == od::objects::kIdentity) {
        variable.notes.value_formula = false;
      }
    }
  }
}

// Whether the application owns the value, whatever access other nodes have: the manufacturer status
// register, names and versions, and everything beyond the communication profile.
bool is_own(std::uint16_t index) {
  return index == od::objects::kManufacturerStatus ||
         (index >= od::objects::kDeviceName && index <= od::objects::kSoftwareVersion) ||
         (index >= 0x2000 && index <= 0x9FFF);
}

lss::Address lss_address(od::Dictionary& dictionary) {
  lss::Address out{};
  for (std::uint8_t part = 0; part < lss::kParts; ++part) {
    out[part] = static_cast<std::uint32_t>(
        dictionary.number({od::objects::kIdentity, static_cast<std::uint8_t>(part + 1)})
            .value_or(0));
  }
  return out;
}

}  // namespace

void VirtualDevice::Mirror::add(std::uint8_t sub, std::uint32_t entry) {
  if (sub >= entries_.size()) {
    entries_.resize(sub + std::size_t{1}, kNoEntry);
  }
  entries_[sub] = entry;
}

void VirtualDevice::Mirror::written(od::Address address) {
  if (address.sub < entries_.size() && entries_[address.sub] != kNoEntry) {
    device_.copy_to_image(direction_, entries_[address.sub], address);
  }
}

void VirtualDevice::Mirror::came_by_rpdo(od::Address address) {
  written(address);
}

AbortCode VirtualDevice::Watcher::execute_write(od::Address address,
                                                std::span<const std::byte> value) {
  device_.report_write(address, value);
  return AbortCode::none;
}

void VirtualDevice::Conversion::written(od::Address address) {
  device_.convert({profile::IoBehaviour::converted_by(address.index), address.sub});
}

VirtualDevice::VirtualDevice(const DeviceConfig& config, const LineConfig& line,
                             image::ProcessImage& image, EventLog& events,
                             emcy::SentReporter& reporter)
    : id_(config.id),
      options_{.error_scheme = line.error_scheme,
               .fd = line.canopen_fd,
               .usdo_abort = line.usdo_abort,
               .emcy_fd = line.emcy_fd},
      image_(image),
      reporter_(reporter),
      events_(events, config.id),
      transmitted_(image) {
  build(config.device);
  if (config.lss) {
    description_ = config.device;
    keep_identity(description_);
    lss_ = std::make_unique<DeviceLss>(lss_address(node_->dictionary()), line.bit_rate);
  }
}

void VirtualDevice::build(const od::DeviceDescription& description) {
  node::Options options = options_;
  options.node_id = description.node_id;
  io_.reset();
  node_.reset();
  mirrors_.clear();
  events_.set_own_node(description.node_id);
  node_ = std::make_unique<node::Node>(od::Dictionary(description), options, events_, nullptr);
  node_->set_application(this);
  node_->pdos().follow_transmission();
  node_->emcy().set_reporter(&reporter_);
  node_->set_medium(medium_);
  if (utc_) {
    node_->clock().set_utc(*utc_);
  }
  const std::uint64_t type = node_->dictionary().number({od::objects::kDeviceType, 0}).value_or(0);
  if ((type & kProfileOf1000h) == profile::kIoProfile) {
    io_.emplace(node_->dictionary());
    for (const std::uint16_t index : node_->dictionary().indices()) {
      if (profile::IoBehaviour::converted_by(index) != 0) {
        LINEGATE_ASSERT(node_->dictionary().add_hook(index, conversion_).ok(), "the object exists");
      }
    }
  }
  mirror(Direction::inputs);
  mirror(Direction::outputs);
  transmitted_.assign(entries_[static_cast<std::size_t>(Direction::outputs)]);
  for (const std::uint16_t index : node_->dictionary().indices()) {
    LINEGATE_ASSERT(node_->dictionary().add_hook(index, watcher_).ok(), "the object exists");
  }
}

// Values that depend on the node-ID change; the values of the application are kept.
void VirtualDevice::rebuild(std::uint8_t node_id) {
  if (node_->node_id() == node_id) {
    return;
  }
  before_ = counts();
  build(od::with_node_id(description_, node_id));
  by_itself_ = true;
  reset(true, now_);
  by_itself_ = false;
}

// One hook for each object; it is called for RPDOs if the object may be received.
void VirtualDevice::mirror(Direction direction) {
  const auto side = static_cast<std::size_t>(direction);
  const std::vector<image::Entry>& entries = image_.layout(direction).entries;
  std::map<std::uint16_t, Mirror*> by_index;
  entries_[side].clear();
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    if (entries[i].node != id_) {
      continue;
    }
    entries_[side].push_back(i);
    if (entries[i].remote_pdo != 0) {
      numbers_[side][entries[i].remote_pdo] = entries[i].local_pdo;
    }
    Mirror*& mirror = by_index[entries[i].index];
    if (mirror == nullptr) {
      mirror = mirrors_.emplace_back(std::make_unique<Mirror>(*this, direction)).get();
      const od::Watch watch = direction == Direction::inputs ? od::Watch::rpdos : od::Watch::writes;
      LINEGATE_ASSERT(node_->dictionary().add_hook(entries[i].index, *mirror, watch).ok(),
                      "the object exists");
    }
    mirror->add(entries[i].sub, i);
  }
}

void VirtualDevice::copy_to_image(Direction direction, std::uint32_t entry, od::Address address) {
  const bool is_output = direction == Direction::outputs;
  if (is_output && from_image_) {
    return;
  }
  auto value = node_->dictionary().number(address);
  if (!value) {
    if (is_output) {
      image_.forget_entry(direction, entry);  // a string that has become too long
    }
    return;
  }
  if (io_ && !is_output) {
    value = io_->terminal_value(address, *value, image_.read_entry(direction, entry));
  }
  const bool is_other =
      is_output && (!image_.is_known(direction, entry) || value_of(entry) != *value);
  image_.write_entry(direction, entry, *value);
  if (is_other) {
    transmitted_.changed(entry);
  } else if (is_output) {
    transmitted_.written(entry);
  }
}

std::uint64_t VirtualDevice::value_of(std::uint32_t output) const {
  const image::Entry& entry = image_.layout(Direction::outputs).entries[output];
  const std::uint64_t value = image_.read_entry(Direction::outputs, output);
  return io_ ? io_->input_value({entry.index, entry.sub}, value) : value;
}

void VirtualDevice::copy_from_image(std::uint32_t output) {
  const image::Entry& entry = image_.layout(Direction::outputs).entries[output];
  const od::Address address{entry.index, entry.sub};
  const std::uint64_t value = value_of(output);
  if (node_->dictionary().number(address) != value) {
    transmitted_.changed(output);
  }
  const bool outer = std::exchange(from_image_, true);
  if (od::has_fixed_size(entry.type)) {
    node_->dictionary().set(address, value);
  } else {
    std::array<std::byte, sizeof value> octets;
    store_le(octets.data(), value);
    node_->dictionary().set(address, std::span(octets).first(entry.bit_length / 8U));
  }
  from_image_ = outer;
}

// The values of the image and of the device are unchanged, but the conversion between them is not:
// one of them is computed again.
void VirtualDevice::convert(od::Address process) {
  for (const auto direction : {Direction::inputs, Direction::outputs}) {
    for (const std::uint32_t i : entries_[static_cast<std::size_t>(direction)]) {
      const image::Entry& entry = image_.layout(direction).entries[i];
      if (od::Address{entry.index, entry.sub} != process) {
        continue;
      }
      if (direction == Direction::inputs) {
        copy_to_image(direction, i, process);
      } else if (image_.is_known(direction, i)) {
        apply_outputs(std::span(&i, 1), false, now_);
      }
    }
  }
}

void VirtualDevice::start(Instant now) {
  now_ = now;
  if (lss_ != nullptr) {
    lss_->power_on();
    if (!lss_->has_node_id()) {
      return;
    }
    rebuild(lss_->slave().active_node_id());
  }
  start_node(now);
  reset_.reset();  // the LSS slave has already processed this power-on
  transmitted_.follow(node_->pdos());
}

// Stored values are applied as by a reset.
void VirtualDevice::start_node(Instant now) {
  by_itself_ = true;
  node_->start(now);
  by_itself_ = false;
}

bool VirtualDevice::receive(const can::Frame& frame) {
  now_ = frame.time;
  if (lss_ != nullptr && frame.id == lss::kMasterId && !frame.extended()) {
    (void)lss_->slave().receive(frame, lss_->answers());
    follow_lss(frame.time);
    return true;
  }
  if (!has_node_id()) {
    return false;
  }
  const std::uint64_t unused = node_->counters().unused;
  node_->receive({&frame, 1});
  const bool wanted = node_->counters().unused == unused;
  follow(frame.time);
  return wanted;
}

void VirtualDevice::follow(Instant now) {
  follow_lss(now);
  if (has_node_id()) {
    transmitted_.follow(node_->pdos());
    transmitted_.request_new_mpdos(node_->pdos(), now);
  }
}

// NMT resets, and leaving configuration with the first node-ID, activate the pending node-ID.
void VirtualDevice::follow_lss(Instant now) {
  if (lss_ == nullptr) {
    return;
  }
  const bool first = lss_->slave().pop_reset();
  const std::optional<bool> reset = std::exchange(reset_, std::nullopt);
  if (!first && !reset) {
    return;
  }
  const std::uint8_t before = lss_->slave().active_node_id();
  const std::uint8_t active = lss_->slave().reset(reset.value_or(false));
  if (active == before) {
    return;
  }
  ++revision_;
  inputs_lost();
  transmitted_.assign(entries_[static_cast<std::size_t>(Direction::outputs)]);
  if (active != lss::kNoNodeId) {
    rebuild(active);
    start_node(now);
    reset_.reset();
  }
}

void VirtualDevice::advance(Instant now) {
  now_ = now;
  if (lss_ != nullptr) {
    lss_->slave().advance(now);
  }
  if (has_node_id()) {
    node_->advance(now);
  }
  follow(now);
}

Instant VirtualDevice::next_wake() const {
  const Instant wake = lss_ != nullptr ? lss_->slave().next_wake() : kNever;
  return has_node_id() ? earlier(wake, node_->next_wake()) : wake;
}

bool VirtualDevice::next_frame(can::Frame& out, Instant now, std::uint64_t number) {
  now_ = now;
  if (lss_ != nullptr && lss_->slave().silent()) {
    return false;
  }
  return (has_node_id() && node_->next_frame(out, now, number)) ||
         (lss_ != nullptr && lss_->answers().pop(out));
}

bool VirtualDevice::peek(can::Frame& out, Instant now) {
  if (lss_ != nullptr && lss_->slave().silent()) {
    return false;
  }
  if (has_node_id() && node_->peek(out, now)) {
    return true;
  }
  const can::Frame* const answer = lss_ != nullptr ? lss_->answers().first() : nullptr;
  if (answer != nullptr) {
    out.id = answer->id;
    out.flags = answer->flags;
  }
  return answer != nullptr;
}

bool VirtualDevice::wants_to_send(Instant now) const {
  if (lss_ != nullptr && lss_->slave().silent()) {
    return false;
  }
  return (has_node_id() && node_->wants_to_send(now)) ||
         (lss_ != nullptr && !lss_->answers().empty());
}

void VirtualDevice::set_utc(Duration offset) {
  utc_ = offset;
  node_->clock().set_utc(offset);
}

void VirtualDevice::set_medium(storage::Medium* medium) {
  medium_ = medium;
  node_->set_medium(medium);
}

void VirtualDevice::set_lss_medium(storage::Medium* medium) {
  if (lss_ != nullptr) {
    lss_->set_medium(medium);
  }
}

void VirtualDevice::lss_medium_done(bool good) {
  if (lss_ != nullptr) {
    lss_->medium_done(good);
  }
}

void VirtualDevice::command(nmt::Command command, Instant now) {
  now_ = now;
  if (has_node_id()) {
    node_->command(command, now);
    follow(now);
  }
}

VirtualDevice::Counts VirtualDevice::counts() const {
  const pdo::EngineCounters& pdos = node_->pdos().counters();
  return {
      .malformed = before_.malformed + node_->counters().malformed + pdos.too_short + pdos.too_long,
      .received = before_.received + pdos.received,
      .sent = before_.sent + pdos.sent,
      .coalesced = before_.coalesced + pdos.coalesced,
      .syncs = before_.syncs + node_->counters().syncs};
}

// Reentrant: a value that changes the conversion of others causes a second call within this one.
// Each call has its own part of changed_.
void VirtualDevice::apply_outputs(std::span<const std::uint32_t> entries, bool always,
                                  Instant now) {
  now_ = now;
  const std::size_t first = changed_.size();
  for (const std::uint32_t i : entries) {
    const image::Entry& entry = image_.layout(Direction::outputs).entries[i];
    const od::Address address{entry.index, entry.sub};
    const std::uint64_t value = value_of(i);
    const auto before = node_->dictionary().number(address);
    const bool same = before == value;
    if (!same) {
      copy_from_image(i);
    }
    transmitted_.written(i);
    if (same && !always && transmitted_.is_scanned(i)) {
      transmitted_.request(address, node_->pdos(), now);
      continue;
    }
    const bool is_new = !same || !transmitted_.is_transmitted(i);
    if (always || (is_new && (!io_ || io_->is_reported(address, before.value_or(0), value)))) {
      changed_.push_back(address);
    }
  }
  for (std::size_t i = first; i < changed_.size(); ++i) {
    node_->pdos().value_changed(changed_[i], now);
    transmitted_.request(changed_[i], node_->pdos(), now);
  }
  changed_.resize(first);
}

void VirtualDevice::inputs_lost() {
  image_.set_node_valid(id_, false);
}

void VirtualDevice::lose_bus() {
  inputs_lost();
  node_->pdos().forget_transmission();
  transmitted_.lose_bus();
}

std::vector<FramesUnderWay::Awaited> VirtualDevice::frames_of(std::uint32_t output) {
  std::vector<FramesUnderWay::Awaited> frames;
  if (has_node_id()) {
    transmitted_.follow(node_->pdos());
    frames = transmitted_.frames_of(output, *node_);
  }
  for (FramesUnderWay::Awaited& frame : frames) {
    frame.device = id_;
  }
  return frames;
}

OutputWait VirtualDevice::reason_of(std::uint32_t output, bool stuck) const {
  LINEGATE_ASSERT(!image_.is_valid(Direction::outputs, output), "the entry waits");
  if (!image_.is_known(Direction::outputs, output)) {
    return OutputWait::value;
  }
  if (!has_node_id() || node_->state() != nmt::State::operational) {
    return OutputWait::own_node;
  }
  return transmitted_.reason_of(output, node_->pdos(), stuck);
}

emcy::SendResult VirtualDevice::send_emcy(std::uint16_t code, std::uint8_t error_register,
                                          std::span<const std::byte> info, Instant now) {
  now_ = now;
  const emcy::SendResult result = node_->report_error(code, error_register, info, now);
  if (result == emcy::SendResult::sent || result == emcy::SendResult::queued) {
    note_emcy(code);
  }
  return result;
}

NodeState VirtualDevice::state() const {
  const od::Dictionary& dictionary = std::as_const(*node_).dictionary();
  const auto u32 = [&](std::uint16_t index, std::uint8_t sub) {
    return static_cast<std::uint32_t>(dictionary.number({index, sub}).value_or(0));
  };
  NodeState out;
  out.node = id_;
  out.configured = true;
  out.state = has_node_id() ? node_->state() : nmt::State::initialising;
  out.presence = has_node_id() ? Presence::present : Presence::missing;
  out.device_type = u32(od::objects::kDeviceType, 0);
  out.vendor = u32(od::objects::kIdentity, 1);
  out.product = u32(od::objects::kIdentity, 2);
  out.revision = u32(od::objects::kIdentity, 3);
  out.serial = u32(od::objects::kIdentity, 4);
  out.error_register = static_cast<std::uint8_t>(u32(od::objects::kErrorRegister, 0));
  out.last_emcy = last_emcy_;
  out.emcy_count = emcys_;
  return out;
}

OwnDevice VirtualDevice::shown() const {
  return has_node_id() ? OwnDevice{node_->node_id(), node_->indicators()} : OwnDevice{};
}

void VirtualDevice::note_emcy(std::uint16_t code) {
  last_emcy_ = code;
  ++emcys_;
  ++revision_;
}

void VirtualDevice::touch(Direction direction, std::uint16_t pdo, Instant now) {
  const Numbers& numbers = numbers_[static_cast<std::size_t>(direction)];
  if (pdo < numbers.size() && numbers[pdo] != 0) {
    image_.area(direction).touch(numbers[pdo] - 1U, now);
  }
}

void VirtualDevice::rpdo_received(std::uint16_t number, Instant now) {
  touch(Direction::inputs, number, now);
}

void VirtualDevice::before_tpdo(std::uint16_t number) {
  touch(Direction::outputs, number, now_);
}

void VirtualDevice::tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs) {
  transmitted_.follow(node_->pdos());
  transmitted_.transmitted(number, differs);
}

void VirtualDevice::mpdo_transmitted(od::Address source) {
  transmitted_.follow(node_->pdos());
  transmitted_.transmitted(source);
}

void VirtualDevice::state_changed(nmt::State state, Instant now) {
  now_ = now;
  ++revision_;
  const nmt::State before = std::exchange(last_state_, state);
  transmitted_.follow(node_->pdos());
  transmitted_.set_operational(state == nmt::State::operational);
  if (state == nmt::State::operational) {
    transmitted_.request_mpdos(node_->pdos(), now);
    return;
  }
  const bool failed = state == nmt::State::stopped || !node_->error_free();
  if (io_ && before == nmt::State::operational && failed) {
    io_->apply_error_values();
  }
  inputs_lost();
}

bool VirtualDevice::may_send_emcy(std::uint16_t code, std::span<std::byte, 5> /*info*/) {
  note_emcy(code);
  return true;
}

bool VirtualDevice::is_in_image(od::Address address) const {
  for (const auto direction : {Direction::inputs, Direction::outputs}) {
    const auto& entries = image_.layout(direction).entries;
    for (const std::uint32_t i : entries_[static_cast<std::size_t>(direction)]) {
      if (od::Address{entries[i].index, entries[i].sub} == address) {
        return true;
      }
    }
  }
  return false;
}

void VirtualDevice::report_write(od::Address address, std::span<const std::byte> value) {
  if (!by_itself_ && !is_in_image(address)) {
    events_.emit({.time = now_, .node = node_->node_id(), .data = written_event(address, value)});
  }
}

void VirtualDevice::time_received(const time::TimeOfDay& time, Instant now) {
  constexpr Duration kPause = std::chrono::milliseconds(900);  // TIME every second may be early
  if (time_reported_ && now - *time_reported_ < kPause) {
    return;
  }
  time_reported_ = now;
  events_.emit(
      {.time = now, .node = node_->node_id(), .data = event::TimeReceived{time::to_utc(time)}});
}

AbortCode VirtualDevice::write(od::Address address, std::span<const std::byte> value, bool own,
                               Instant now) {
  now_ = now;
  od::Dictionary& dictionary = node_->dictionary();
  AbortCode why = AbortCode::none;
  by_itself_ = true;
  if (!own) {
    why = dictionary.write(address, value);
  } else if (!is_own(address.index)) {
    why = AbortCode::unsupported_access;
  } else if (dictionary.find(address, &why)) {
    why = dictionary.set(address, value) ? AbortCode::none : AbortCode::length_mismatch;
    if (why == AbortCode::none && !is_in_image(address)) {
      own_values_[address].assign(value.begin(), value.end());
    }
  }
  by_itself_ = false;
  follow(now);
  if (why == AbortCode::none) {
    node_->pdos().value_changed(address, now);
    transmitted_.request(address, node_->pdos(), now);
  }
  return why;
}

// The values of the application are kept. The values of the master are reset: by reset
// communication only those of the communication profile area (CiA 301 7.3.2.2.1).
void VirtualDevice::reset(bool whole_node, Instant now) {
  now_ = now;
  reset_ = whole_node || reset_.value_or(false);
  if (!by_itself_) {
    const auto command = whole_node ? nmt::Command::reset_node : nmt::Command::reset_communication;
    events_.emit({.time = now, .node = node_->node_id(), .data = event::OwnReset{command}});
  }
  for (const auto& [address, value] : own_values_) {
    if (whole_node || address.index <= od::objects::kLastCommunication) {
      node_->dictionary().set(address, value);
    }
  }
  if (!whole_node) {
    return;
  }
  for (const std::uint32_t i : entries_[static_cast<std::size_t>(Direction::outputs)]) {
    if (image_.is_known(Direction::outputs, i)) {
      copy_from_image(i);
    }
  }
  for (const std::uint32_t i : entries_[static_cast<std::size_t>(Direction::inputs)]) {
    const image::Entry& entry = image_.layout(Direction::inputs).entries[i];
    copy_to_image(Direction::inputs, i, {entry.index, entry.sub});
  }
}

}  // namespace linegate::line
