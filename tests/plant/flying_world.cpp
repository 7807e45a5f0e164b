// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/flying_world.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/can/cob_id.h"
#include "stack/eds/reader.h"
#include "stack/node/sdo_clients.h"

#include "tests/plant/sdo_channel.h"

namespace linegate::plant {
namespace {

using namespace std::chrono_literals;

constexpr Duration kFlyingMasterTimeout = 100ms;
constexpr Duration kFlyingNegotiationDelay = 200ms;
constexpr Duration kFlyingPrioritySlot = 800ms;
constexpr Duration kFlyingDeviceSlot = 6ms;
constexpr Duration kFlyingDetectCycle = 2s;
constexpr Duration kFlyingHeartbeat = 200ms;

Duration cycle_of(std::uint8_t node) {
  return kFlyingDetectCycle + 10ms * node;
}

}  // namespace

FlyingWorld::FlyingWorld(FlyingPlan plan)
    : plan_(std::move(plan)),
      bus_({.bit_rate = 500'000, .data_bit_rate = plan_.fd ? 2'000'000U : 0U, .queue_depth = 8}) {
  for (const std::uint8_t node : kDevices) {
    sim::DeviceOptions options{
        .profile = profile(), .node_id = node, .seed = node, .heartbeat = 100ms};
    options.fd = plan_.fd;
    devices_.push_back(
        {.device = *std::move(sim::Device::make(options).value), .end = bus_.attach()});
    if (plan_.connects) {
      sim::Device& device = *devices_.back().device;
      add_channel(device.dictionary(), kClientChannel);
      add_channel(device.dictionary(), kServerChannel);
      device.node().sdo_clients().configure();
    }
    devices_.back().device->start(now_);
  }
  for (const FlyingPlan::Master& master : plan_.lines) {
    stations_.push_back({.plan = master, .end = bus_.attach()});
  }
  if (plan_.foreign) {
    stations_.push_back({.plan = *plan_.foreign, .is_foreign = true, .end = bus_.attach()});
  }
  outputs_ = static_cast<std::uint32_t>((*line::Line::make(config_of({.node = 20})).value)
                                            ->layout(image::Direction::outputs)
                                            .entries.size());
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    revive(i);
  }
}

line::LineConfig FlyingWorld::config_of(const FlyingPlan::Master& master) const {
  line::LineConfig out;
  out.name = "hall";
  out.node_id = master.node;
  out.bit_rate = 500'000;
  out.heartbeat = kFlyingHeartbeat;
  out.canopen_fd = plan_.fd;
  if (plan_.connects) {
    out.connection_pool = {0x680, 0x683};
  }
  out.flying_master = {.priority = master.priority,
                       .master_timeout = kFlyingMasterTimeout,
                       .negotiation_delay = kFlyingNegotiationDelay,
                       .priority_slot = kFlyingPrioritySlot,
                       .device_slot = kFlyingDeviceSlot,
                       .detect_cycle = cycle_of(master.node),
                       .master_heartbeat = plan_.master_heartbeat,
                       .forces_each_cycle = master.forces};
  out.sync_period = plan_.sync ? 50ms : 0ms;
  for (std::uint32_t entry = 0; plan_.defaults && entry < outputs_; ++entry) {
    out.defaults.push_back({.entry = entry, .value = 0});
  }
  for (const std::uint8_t id : kDevices) {
    line::NodeConfig node;
    node.id = id;
    node.name = "io" + std::to_string(id);
    node.device = *eds::load(sim::eds_text(profile()), sim::eds_name(profile()), id).value;
    node.heartbeat = 100ms;
    node.keep_alive = id == kDevices[1] && plan_.keep_alive;
    out.nodes.push_back(std::move(node));
  }
  return out;
}

void FlyingWorld::kill(std::size_t station) {
  Station& which = stations_[station];
  which.line.reset();
  which.foreign.reset();
  bus_.flush(which.end);
}

void FlyingWorld::revive(std::size_t station) {
  Station& which = stations_[station];
  std::array<can::Frame, 16> old;
  while (bus_.take(which.end, old) != 0) {
  }
  if (which.is_foreign) {
    which.foreign = std::make_unique<ForeignMaster>(
        which.plan.node, which.plan.priority,
        ForeignMaster::Times{.master_timeout = kFlyingMasterTimeout,
                             .negotiation_delay = kFlyingNegotiationDelay,
                             .priority_slot = kFlyingPrioritySlot,
                             .device_slot = kFlyingDeviceSlot,
                             .detect_cycle = cycle_of(which.plan.node),
                             .heartbeat = kFlyingHeartbeat});
    which.foreign->start(now_);
    return;
  }
  which.line = *std::move(line::Line::make(config_of(which.plan)).value);
  which.sent_before = bus_.acknowledged(which.end);
  which.runs_from = {};
  if (plan_.cut == CutEnd::acknowledgement) {
    which.line->expect_acknowledgements();
  }
  if (!connected(station)) {
    report_cut(which);
  }
  which.line->start(now_);
}

void FlyingWorld::report_cut(Station& station) {
  if (plan_.cut == CutEnd::bus_off && station.line != nullptr) {
    const bool connected = bus_.connected(station.end);
    station.line->bus_event(
        {.state = connected ? can::BusState::error_active : can::BusState::bus_off, .time = now_});
  }
}

std::uint64_t FlyingWorld::resets() const {
  std::uint64_t out = 0;
  for (const Seat& seat : devices_) {
    out += seat.device->node().counters().resets;
  }
  return out;
}

void FlyingWorld::connect(std::size_t station, bool connected) {
  Station& which = stations_[station];
  if (connected == this->connected(station)) {
    return;
  }
  bus_.set_connected(which.end, connected, now_);
  if (!connected && plan_.cut == CutEnd::bus_off) {
    bus_.flush(which.end);
  }
  report_cut(which);
}

Instant FlyingWorld::next_event() const {
  Instant out = bus_.next_wake();
  for (const Station& station : stations_) {
    if (station.alive() && station.runs_from > now_) {
      out = earlier(out, station.runs_from);
    } else if (station.alive()) {
      out = earlier(out, bus_.first_waiting(station.end));
      out = earlier(
          out, station.line != nullptr ? station.line->next_wake() : station.foreign->next_wake());
    }
  }
  for (const Seat& seat : devices_) {
    out = earlier(out, earlier(bus_.first_waiting(seat.end), seat.device->next_wake()));
  }
  return std::max(out, now_);
}

void FlyingWorld::run(Instant until) {
  for (Instant next = next_event(); next <= until; next = next_event()) {
    // What is due again at once is due after the time of a round.
    now_ = next > now_ ? next : now_ + 10us;
    step();
  }
  now_ = std::max(now_, until);
  step();
}

void FlyingWorld::step() {
  bus_.advance(now_);
  for (Station& station : stations_) {
    turn(station);
  }
  for (Seat& seat : devices_) {
    turn(seat);
  }
}

void FlyingWorld::turn(Station& station) {
  if (station.runs_from > now_) {
    return;
  }
  std::array<can::Frame, 16> batch;
  while (const std::size_t count = bus_.take(station.end, batch)) {
    const std::span<const can::Frame> frames = std::span(batch).first(count);
    if (station.line != nullptr) {
      station.line->receive(frames, now_);
    } else if (station.foreign != nullptr) {
      std::ranges::for_each(frames, [&](const auto& frame) { station.foreign->receive(frame); });
    }
  }
  can::Frame frame;
  if (station.line != nullptr) {
    if (plan_.cut == CutEnd::acknowledgement) {
      station.line->acknowledged(bus_.acknowledged(station.end) - station.sent_before, now_);
    }
    station.line->advance(now_);
    while (bus_.room(station.end) > 0 && station.line->next_frame(frame, now_)) {
      check_sent(station, frame);
      bus_.submit(station.end, frame, now_);
    }
  } else if (station.foreign != nullptr) {
    station.foreign->advance(now_);
    while (bus_.room(station.end) > 0 && station.foreign->next_frame(frame)) {
      bus_.submit(station.end, frame, now_);
    }
  }
}

void FlyingWorld::turn(Seat& seat) {
  std::array<can::Frame, 16> batch;
  while (const std::size_t count = bus_.take(seat.end, batch)) {
    seat.device->receive(std::span(batch).first(count));
  }
  seat.device->advance(now_);
  can::Frame frame;
  while (bus_.room(seat.end) > 0 && seat.device->next_frame(frame, now_)) {
    bus_.submit(seat.end, frame, now_);
  }
}

// A slave sends no NMT command but the reset of a search, no request but an abort, and no output.
void FlyingWorld::check_sent(const Station& station, const can::Frame& frame) {
  if (station.line->state().role == line::Role::manager || !failure_.empty()) {
    return;
  }
  const bool is_reset =
      frame.id == can::kNmtId && frame.data[0] == std::byte{0x82} && frame.data[1] == std::byte{};
  const bool is_of_master_messages = frame.id >= 0x072 && frame.id <= 0x076;
  const bool is_own_error_control = frame.id == can::kErrorControlBase + station.plan.node;
  const bool is_own_emcy = frame.id == can::kEmcyBase + station.plan.node;
  // Ends a transfer of the time as the active master.
  const bool is_sdo_request =
      frame.id > can::kSdoRequestBase && frame.id <= can::kSdoRequestBase + can::kMaxNodeId;
  const bool is_abort = is_sdo_request && (frame.fd() ? frame.data[1] == std::byte{0x7F}
                                                      : frame.data[0] == std::byte{0x80});
  if (!is_reset && !is_of_master_messages && !is_own_error_control && !is_own_emcy && !is_abort) {
    failure_ = "node " + std::to_string(station.plan.node) + " sent a frame with the identifier " +
               std::to_string(frame.id) + " and the data";
    for (std::size_t i = 0; i < frame.length; ++i) {
      failure_ += " " + std::to_string(std::to_integer<unsigned>(frame.data[i]));
    }
    failure_ += " as a slave" + describe();
  }
}

bool FlyingWorld::is_master(std::size_t station) const {
  const Station& which = stations_[station];
  if (which.line != nullptr) {
    const line::LineState state = which.line->state();
    return state.flying_master == nmt::FlyingMasterState::master;
  }
  return which.foreign != nullptr && which.foreign->is_master();
}

std::string FlyingWorld::wrong_masters() const {
  std::size_t joined = 0;
  std::size_t masters = 0;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!alive(i)) {
      continue;
    }
    if (!connected(i)) {
      const bool notices = plan_.cut != CutEnd::nothing && !is_foreign(i);
      if (is_master(i) == notices) {
        return "node " + std::to_string(stations_[i].plan.node) + " is cut off and " +
               (notices ? "a" : "no") + " master";
      }
      continue;
    }
    ++joined;
    masters += is_master(i) ? 1U : 0U;
  }
  return joined == 0 || masters == 1 ? "" : std::to_string(masters) + " masters on the bus";
}

Duration FlyingWorld::bound() const {
  Duration cycle{};
  for (const Station& station : stations_) {
    cycle = std::max(cycle, cycle_of(station.plan.node));
  }
  return cycle + 3 * (kFlyingMasterTimeout + kFlyingHeartbeat) +
         2 * (kFlyingNegotiationDelay + kFlyingMasterTimeout) + 2 * kFlyingPrioritySlot +
         127 * kFlyingDeviceSlot + 100ms;
}

std::string FlyingWorld::describe() const {
  std::string out = "; at " + std::to_string(now_.time_since_epoch() / 1ms) + " ms";
  out += plan_.fd ? ", CANopen FD" : "";
  for (const Seat& seat : devices_) {
    out += ", " + std::string(nmt::name(seat.device->node().state()));
  }
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    const Station& station = stations_[i];
    out += "\n  node " + std::to_string(station.plan.node) + " priority " +
           std::to_string(station.plan.priority) + (station.is_foreign ? " foreign" : "") +
           (alive(i) ? "" : " dead") + (connected(i) ? "" : " cut off");
    if (station.line != nullptr) {
      out += " " + std::string(nmt::name(station.line->state().flying_master)) + " of " +
             std::to_string(station.line->state().active_master);
      for (const std::uint8_t node : kDevices) {
        const line::NodeState seen = station.line->node_state(node);
        out += "; " + std::to_string(node) + " " + std::string(nmt::name(seen.state)) + " boot " +
               seen.boot;
      }
    } else if (station.foreign != nullptr) {
      out += station.foreign->is_master() ? " master" : "";
    }
  }
  return out;
}

}  // namespace linegate::plant
