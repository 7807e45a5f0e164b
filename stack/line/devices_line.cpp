// SPDX-License-Identifier: Apache-2.0
#include "stack/line/devices_line.h"

#include <algorithm>
#include <utility>

#include "stack/time/service.h"

namespace linegate::line {

using image::Direction;

DevicesLine::DevicesLine(LineConfig line_config, pdo::LinkPlan plan)
    : Line(std::move(line_config)),
      image(std::move(plan.inputs), std::move(plan.outputs)),
      outputs(image.layout(Direction::outputs), config_.groups, config_.bound) {
  image.follow_transmission();
  for (const DeviceConfig& device : config_.devices) {
    auto reporter = std::make_unique<EmcyReporter>(*this, device.id);
    auto virtual_device =
        std::make_unique<VirtualDevice>(device, config_, image, events_, *reporter);
    seats.push_back({.reporter = std::move(reporter), .device = std::move(virtual_device)});
  }
  std::ranges::sort(seats, {}, [](const Seat& seat) { return seat.device->id(); });
}

VirtualDevice* DevicesLine::find(std::uint8_t id) const {
  for (const Seat& seat : seats) {
    if (seat.device->id() == id) {
      return seat.device.get();
    }
  }
  return nullptr;
}

const image::Layout& DevicesLine::layout(Direction direction) const {
  return image.layout(direction);
}

void DevicesLine::do_start(Instant now) {
  apply_defaults(now);
  for (const Seat& seat : seats) {
    seat.device->start(now);
  }
}

bool DevicesLine::hear(const can::Frame& frame, const Seat* except) {
  bool wanted = false;
  for (const Seat& seat : seats) {
    if (&seat != except) {
      wanted |= seat.device->receive(frame);
    }
  }
  return wanted;
}

void DevicesLine::do_receive(std::span<const can::Frame> frames) {
  for (const can::Frame& frame : frames) {
    received.add(frame);
    hear_boot_up(frame);
    if (!hear(frame, nullptr)) {
      ++counters_.frames_unused;
      listening.hear(frame, events_);
    }
  }
  count_syncs();
}

// Reports boot-up messages of nodes that are not devices of the line, at most once a second for
// each node.
void DevicesLine::hear_boot_up(const can::Frame& frame) {
  constexpr Duration kPause = std::chrono::seconds(1);
  const bool boot_up = frame.id > can::kErrorControlBase &&
                       frame.id <= can::kErrorControlBase + can::kMaxNodeId && !frame.extended() &&
                       !frame.remote() && frame.length == 1 && frame.data[0] == std::byte{};
  if (!boot_up) {
    return;
  }
  const auto id = static_cast<std::uint8_t>(frame.id - can::kErrorControlBase);
  std::optional<Instant>& last = boot_ups[id];
  const bool own = std::ranges::any_of(
      seats, [id](const Seat& seat) { return seat.device->shown().node_id == id; });
  if (!own && (!last || frame.time - *last >= kPause)) {
    last = frame.time;
    events_.emit({.time = frame.time, .node = id, .data = event::BootUp{}});
  }
}

// The maximum over the devices: some may have no SYNC object, or be stopped.
void DevicesLine::count_syncs() {
  for (const Seat& seat : seats) {
    syncs_ = std::max(syncs_, static_cast<std::uint32_t>(seat.device->counts().syncs));
  }
}

void DevicesLine::do_set_medium(storage::Medium* medium, ParameterSet of) {
  VirtualDevice* device = find(of.device);
  if (device == nullptr) {
    return;
  }
  if (of.kind == ParameterSet::Kind::lss) {
    device->set_lss_medium(medium);
  } else {
    device->set_medium(medium);
  }
}

void DevicesLine::do_medium_done(bool good, ParameterSet of) {
  VirtualDevice* device = find(of.device);
  if (device == nullptr) {
    return;
  }
  if (of.kind == ParameterSet::Kind::lss) {
    device->lss_medium_done(good);
  } else {
    device->node().medium_done(good);
  }
}

void DevicesLine::do_bus_event(const can::BusEvent& event) {
  for (const Seat& seat : seats) {
    seat.device->node().bus_event(event);
    if (usable()) {
      seat.device->find_bus(event.time);
    } else {
      seat.device->lose_bus();
    }
  }
}

bool DevicesLine::advance(Instant now) {
  advanced_to = now;
  events_.advance(now);
  for (const Seat& seat : seats) {
    seat.device->advance(now);
  }
  follow_resets(now);
  expire_sendings(now);
  count_syncs();
  while (const Outputs::Group* group = outputs.expire(now)) {
    react(*group, now);
  }
  can::Traffic seen = sent;
  seen += received;
  load_.advance(seen, now);
  return true;
}

Instant DevicesLine::next_wake() const {
  Instant wake = earlier(events_.next_wake(), outputs.next_wake());
  wake = earlier(wake, under_way_.next_deadline());
  for (const Seat& seat : seats) {
    wake = earlier(wake, seat.device->next_wake());
  }
  return wake;
}

// Takes the most urgent frame of each device, and of these the one that would win arbitration. The
// other devices receive it, and keep their own frames, which newer values may still replace.
bool DevicesLine::do_next_frame(can::Frame& out, Instant now) {
  Seat* best = nullptr;
  can::Frame first;
  can::Frame offer;
  for (Seat& seat : seats) {
    if (seat.device->peek(offer, now) && (best == nullptr || can::wins_arbitration(offer, first))) {
      best = &seat;
      std::swap(first, offer);
    }
  }
  const std::uint64_t number = under_way_.next_number();
  if (best == nullptr || !best->device->next_frame(out, now, number)) {
    return false;
  }
  sent.add(out);
  if (under_way_.expected()) {
    note_handed_out(out, now, best->device->id());
  }
  if (seats.size() > 1) {
    can::Frame heard = out;
    heard.time = now;
    (void)hear(heard, best);
  }
  return true;
}

bool DevicesLine::wants_to_send(Instant now) const {
  return std::ranges::any_of(seats,
                             [now](const Seat& seat) { return seat.device->wants_to_send(now); });
}

// A device that is switched off stops transmitting.
void DevicesLine::do_stop(Instant now) {
  for (const Seat& seat : seats) {
    seat.device->command(nmt::Command::enter_pre_operational, now);
    seat.device->inputs_lost();
  }
  cancel_sendings();
}

void DevicesLine::snapshot(Direction direction, image::Snapshot& into, Instant now, bool merge) {
  image.snapshot(direction, into, now, merge, syncs_);
}
bool DevicesLine::image_changed(Direction direction) const {
  return image.changed(direction);
}
bool DevicesLine::image_touched(Direction direction) const {
  return image.touched(direction);
}

Line::Input DevicesLine::input(std::uint32_t entry, std::uint8_t part) const {
  return {.value = part == 0 ? image.read_entry(Direction::inputs, entry)
                             : image.read_part(Direction::inputs, entry, part),
          .valid = image.is_valid(Direction::inputs, entry)};
}

void DevicesLine::set_utc(Duration offset) {
  for (const Seat& seat : seats) {
    seat.device->set_utc(offset);
  }
}

std::optional<Duration> DevicesLine::network_utc(Instant now) const {
  for (const Seat& seat : seats) {
    if (const auto utc = seat.device->node().clock().network_utc(now)) {
      return utc;
    }
  }
  return std::nullopt;
}

LineState DevicesLine::do_state() const {
  LineState out;
  out.role = config_.role;
  out.node_id = seats.front().device->id();
  out.network_id = config_.network_id;
  out.own_state = seats.front().device->node().state();
  out.indicators = indicators();
  out.bus = bus_;
  out.transmit_errors = transmit_errors_;
  out.receive_errors = receive_errors_;
  out.load_permille = load_.permille();
  out.nodes_configured = static_cast<std::uint8_t>(seats.size());
  out.counters = counters_;
  for (const Seat& seat : seats) {
    if (seat.device->node().state() == nmt::State::operational) {
      ++out.nodes_operational;
    }
    const VirtualDevice::Counts counts = seat.device->counts();
    out.counters.frames_malformed += counts.malformed;
    out.counters.rpdos += counts.received;
    out.counters.tpdos += counts.sent;
    out.counters.tpdos_coalesced += counts.coalesced;
  }
  out.counters.frames_received = received.frames;
  out.counters.frames_sent = sent.frames;
  out.counters.syncs = syncs_;
  out.counters.events = events_.emitted();
  out.counters.events_lost = events_.lost();
  return out;
}

node::Indicators DevicesLine::indicators() const {
  return seats.front().device->node().indicators();
}

std::optional<OwnDevice> DevicesLine::own_device(std::uint8_t id) const {
  const VirtualDevice* device = find(id);
  return device == nullptr ? std::nullopt : std::optional(device->shown());
}

// Indicator patterns change with time alone, so they are part of the revision.
std::uint64_t DevicesLine::do_node_revision(std::uint8_t id) const {
  constexpr unsigned kPatternBits = 4;
  const VirtualDevice* device = find(id);
  if (device == nullptr) {
    return 0;
  }
  const node::Indicators shown = device->shown().indicators;
  return (device->revision() << kPatternBits | static_cast<std::uint64_t>(shown.run))
             << kPatternBits |
         static_cast<std::uint64_t>(shown.error);
}

NodeState DevicesLine::do_node_state(std::uint8_t id) const {
  const VirtualDevice* device = find(id);
  return device == nullptr ? NodeState{.node = id} : device->state();
}

od::Dictionary& DevicesLine::do_dictionary() {
  return seats.front().device->node().dictionary();
}

const od::Dictionary& DevicesLine::do_dictionary() const {
  return seats.front().device->node().dictionary();
}

}  // namespace linegate::line
