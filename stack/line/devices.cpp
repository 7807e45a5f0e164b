// SPDX-License-Identifier: Apache-2.0
#include "stack/line/devices.h"

#include <algorithm>
#include <utility>

#include "stack/time/service.h"

namespace linegate::line {

using image::Direction;

Line::Devices::Devices(LineConfig line_config, pdo::LinkPlan plan)
    : Base(std::move(line_config)),
      image(std::move(plan.inputs), std::move(plan.outputs)),
      outputs(image.layout(Direction::outputs), config.groups, config.bound) {
  for (const DeviceConfig& device : config.devices) {
    auto reporter = std::make_unique<EmcyReporter>(*this, device.id);
    auto virtual_device = std::make_unique<VirtualDevice>(device, config, image, events, *reporter);
    seats.push_back({.reporter = std::move(reporter), .device = std::move(virtual_device)});
  }
  std::ranges::sort(seats, {}, [](const Seat& seat) { return seat.device->id(); });
}

namespace {

// Which device a medium with kLssMedium is for.
std::uint8_t lss_slave_of(std::uint8_t medium) {
  return static_cast<std::uint8_t>(medium & ~Line::kLssMedium);
}

}  // namespace

VirtualDevice* Line::Devices::find(std::uint8_t id) const {
  for (const Seat& seat : seats) {
    if (seat.device->id() == id) {
      return seat.device.get();
    }
  }
  return nullptr;
}

const image::Layout& Line::Devices::layout(Direction direction) const {
  return image.layout(direction);
}

void Line::Devices::start(Instant now) {
  running = true;
  emit(EventKind::line_started, now, static_cast<std::uint32_t>(config.role));
  apply_defaults(now);
  for (const Seat& seat : seats) {
    seat.device->start(now);
  }
}

bool Line::Devices::hear(const can::Frame& frame, const Seat* except) {
  bool wanted = false;
  for (const Seat& seat : seats) {
    if (&seat != except) {
      wanted |= seat.device->receive(frame);
    }
  }
  return wanted;
}

void Line::Devices::receive(std::span<const can::Frame> frames) {
  for (const can::Frame& frame : frames) {
    received.add(frame);
    hear_boot_up(frame);
    if (!hear(frame, nullptr)) {
      ++counters.frames_unused;
      listening.hear(frame, events);
    }
  }
  count_syncs();
}

// Of nodes that are not devices of the line, of each at most once a second.
void Line::Devices::hear_boot_up(const can::Frame& frame) {
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
    events.emit({.time = frame.time, .kind = EventKind::boot_up, .node = id});
  }
}

// Some device may have no SYNC object, or be stopped.
void Line::Devices::count_syncs() {
  for (const Seat& seat : seats) {
    syncs = std::max(syncs, static_cast<std::uint32_t>(seat.device->counts().syncs));
  }
}

void Line::Devices::set_medium(storage::Medium* medium, std::uint8_t device) {
  if (VirtualDevice* found = find(device)) {
    found->set_medium(medium);
  } else if (VirtualDevice* slave = find(lss_slave_of(device))) {
    slave->set_lss_medium(medium);
  }
}

void Line::Devices::medium_done(bool good, std::uint8_t device) {
  if (VirtualDevice* found = find(device)) {
    found->node().medium_done(good);
  } else if (VirtualDevice* slave = find(lss_slave_of(device))) {
    slave->lss_medium_done(good);
  }
}

void Line::Devices::bus_event(const can::BusEvent& event) {
  if (!note(event)) {
    return;
  }
  for (const Seat& seat : seats) {
    seat.device->node().bus_event(event);
    if (!usable()) {
      seat.device->inputs_lost();
    }
  }
}

void Line::Devices::advance(Instant now) {
  events.advance(now);
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
  load.advance(seen, now);
}

Instant Line::Devices::next_wake() const {
  Instant wake = earlier(events.next_wake(), outputs.next_wake());
  wake = earlier(wake, under_way.next_deadline());
  for (const Seat& seat : seats) {
    wake = earlier(wake, seat.device->next_wake());
  }
  return wake;
}

// The one that would win arbitration among the most urgent frame of each, as on a bus: the others
// hear it, and keep theirs, which may be replaced by newer ones.
bool Line::Devices::next_frame(can::Frame& out, Instant now) {
  Seat* best = nullptr;
  can::Frame first;
  can::Frame offer;
  for (Seat& seat : seats) {
    if (seat.device->peek(offer, now) && (best == nullptr || can::wins_arbitration(offer, first))) {
      best = &seat;
      std::swap(first, offer);
    }
  }
  if (best == nullptr || !best->device->next_frame(out, now)) {
    return false;
  }
  sent.add(out);
  if (under_way.expected()) {
    note_handed_out(out, now, best->device->id());
  }
  if (seats.size() > 1) {
    can::Frame heard = out;
    heard.time = now;
    (void)hear(heard, best);
  }
  return true;
}

bool Line::Devices::wants_to_send(Instant now) const {
  return std::ranges::any_of(seats,
                             [now](const Seat& seat) { return seat.device->wants_to_send(now); });
}

// A device that is switched off falls silent.
void Line::Devices::stop(Instant now) {
  if (!std::exchange(running, false)) {
    return;
  }
  for (const Seat& seat : seats) {
    seat.device->command(nmt::Command::enter_pre_operational, now);
    seat.device->inputs_lost();
  }
  cancel_sendings();
  emit(EventKind::line_stopped, now);
}

void Line::Devices::snapshot(Direction direction, image::Snapshot& into, Instant now, bool merge) {
  image.snapshot(direction, into, now, merge, syncs);
}
bool Line::Devices::image_changed(Direction direction) const {
  return image.changed(direction);
}
bool Line::Devices::image_touched(Direction direction) const {
  return image.touched(direction);
}

Line::Input Line::Devices::input(std::uint32_t entry) const {
  return {.value = image.read_entry(Direction::inputs, entry),
          .valid = image.is_valid(Direction::inputs, entry)};
}

void Line::Devices::set_utc(Duration offset) {
  for (const Seat& seat : seats) {
    seat.device->set_utc(offset);
  }
}

std::optional<Duration> Line::Devices::network_utc(Instant now) const {
  for (const Seat& seat : seats) {
    if (const auto told = seat.device->node().clock().network_utc(now)) {
      return told;
    }
  }
  return std::nullopt;
}

LineState Line::Devices::state() const {
  LineState out;
  out.role = config.role;
  out.node_id = seats.front().device->id();
  out.network_id = config.network_id;
  out.own_state = seats.front().device->node().state();
  out.indicators = indicators();
  out.bus = bus;
  out.transmit_errors = transmit_errors;
  out.receive_errors = receive_errors;
  out.load_permille = load.permille();
  out.nodes_configured = static_cast<std::uint8_t>(seats.size());
  out.counters = counters;
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
  out.counters.syncs = syncs;
  out.counters.events = events.emitted();
  out.counters.events_lost = events.lost();
  return out;
}

node::Indicators Line::Devices::indicators() const {
  return seats.front().device->node().indicators();
}

std::optional<OwnDevice> Line::Devices::own_device(std::uint8_t id) const {
  const VirtualDevice* device = find(id);
  return device == nullptr ? std::nullopt : std::optional(device->shown());
}

// Patterns change without an event of the device, by time.
std::uint64_t Line::Devices::node_revision(std::uint8_t id) const {
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

NodeState Line::Devices::node_state(std::uint8_t id) const {
  const VirtualDevice* device = find(id);
  return device == nullptr ? NodeState{.node = id} : device->state();
}

od::Dictionary& Line::Devices::dictionary() {
  return seats.front().device->node().dictionary();
}

}  // namespace linegate::line
