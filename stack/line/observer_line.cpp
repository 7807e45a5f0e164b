// SPDX-License-Identifier: Apache-2.0
#include "stack/line/observer_line.h"

#include <map>
#include <tuple>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/dispatch.h"
#include "stack/line/build.h"
#include "stack/nmt/node_control.h"

namespace linegate::line {
namespace {

using image::Direction;

using ObjectPlace =
    std::tuple<std::uint8_t, std::uint16_t, std::uint16_t, std::uint8_t, std::uint16_t>;

ObjectPlace place_of(const image::Entry& entry) {
  return {entry.node, entry.remote_pdo, entry.index, entry.sub, entry.bit_length};
}

sync::Parameters sync_of(const LineConfig& config) {
  return {.exists = true, .cob_id = {can::kSyncId}, .period = config.sync_period};
}

}  // namespace

std::vector<pdo::LinkedPdo> as_received(std::vector<pdo::LinkedPdo> sent) {
  for (pdo::LinkedPdo& pdo : sent) {
    pdo.parameters.type = pdo::kEventProfile;
    pdo.parameters.event_timer = Duration{};
  }
  return sent;
}

void add(pdo::EngineCounters& sum, const pdo::EngineCounters& more) {
  sum.received += more.received;
  sum.too_short += more.too_short;
  sum.too_long += more.too_long;
  sum.receptions_lost += more.receptions_lost;
}

Overheard::Overheard(EventLog& events, can::Dispatch& dispatch, image::Layout layout,
                     std::vector<pdo::LinkedPdo> pdos, std::size_t longest_pdo)
    : image(std::move(layout), image::Layout{.direction = Direction::outputs, .entries = {}}),
      dictionary(od::DeviceDescription{}),
      engine(dictionary, dispatch, events, &image),
      frames(dispatch) {
  engine.set_max_length(longest_pdo);
  link(std::move(pdos));
}

void Overheard::link(std::vector<pdo::LinkedPdo> pdos) {
  sources.clear();
  for (const pdo::LinkedPdo& pdo : pdos) {
    LINEGATE_ASSERT(pdo.parameters.number == sources.size() + 1, "local numbers have no gaps");
    sources.push_back({pdo.node, pdo.remote_pdo, pdo.parameters.cob_id});
  }
  pdo::LinkPlan plan;
  plan.rpdos = std::move(pdos);
  engine.link(plan);
  (void)engine.configure();  // linked PDOs are always valid
}

void Overheard::listen(std::uint8_t node, std::uint16_t remote_pdo, bool on) {
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const auto slot = static_cast<std::uint16_t>(i);
    const can::CobId cob_id = sources[i].cob_id;
    if (sources[i].node != node || sources[i].remote_pdo != remote_pdo) {
      continue;
    }
    if (on) {
      frames.add(cob_id.id(), cob_id.extended(), can::Service::rpdo, slot);
    } else {
      frames.remove(cob_id.id(), cob_id.extended(), can::Service::rpdo, slot);
    }
  }
}

void Overheard::copy_values(const Overheard& before) {
  image.succeed(before.image);
  std::map<ObjectPlace, std::uint32_t> places;
  for (std::uint32_t i = 0; i < before.layout().entries.size(); ++i) {
    places.emplace(place_of(before.layout().entries[i]), i);
  }
  for (std::uint32_t i = 0; i < layout().entries.size(); ++i) {
    const auto old = places.find(place_of(layout().entries[i]));
    if (old == places.end()) {
      continue;
    }
    for (std::uint8_t part = 0; part < image::value_parts(layout().entries[i]); ++part) {
      image.write_part(Direction::inputs, i, part,
                       before.image.read_part(Direction::inputs, old->second, part));
    }
    image.set_entry_valid(Direction::inputs, i,
                          before.image.is_valid(Direction::inputs, old->second));
  }
}

void Overheard::set_all_invalid() {
  for (std::uint32_t entry = 0; entry < layout().entries.size(); ++entry) {
    image.set_pdo_valid(Direction::inputs, layout().entries[entry].local_pdo, false);
  }
}

ObserverLine::ObserverLine(LineConfig line_config, pdo::LinkPlan plan)
    : Line(std::move(line_config)),
      inputs(std::make_unique<Overheard>(events_, dispatch, std::move(plan.inputs), plan.rpdos,
                                         longest_pdo_bytes())),
      outputs(std::make_unique<Overheard>(events_, output_dispatch, std::move(plan.outputs),
                                          as_received(std::move(plan.tpdos)), longest_pdo_bytes())),
      nodes(node_plans(config_), config_.node_id, dispatch, events_, *this),
      channels(dispatch),
      sync(dispatch, events_),
      srdos(dispatch, events_, config_),
      sleep(config_.sleep, 0) {
  events_.limit_overheard();
  srdos.connect(inputs->engine, inputs->image, plan.rpdos);
  for (const NodeConfig& device : config_.nodes) {
    nodes.listen_emcy(device.id, emcy_cob_id(device));
    Device& known = devices.emplace_back(
        Device{observer::PdoKnowledge(device.device, device.id, longest_pdo(config_)), {}});
    known.used = known.pdos.pdos();
    if (!config_.canopen_fd) {
      channels.add(device.id, device.device);
    }
    identifiers.at(device.id) = observer::LearnedParameters(device.device);
    for (const ObjectValue& object : device.objects) {
      if (object.data.size() == sizeof(std::uint32_t) && !config_.canopen_fd) {
        channels.learn(device.id, object.address, load_le<std::uint32_t>(object.data.data()));
      }
    }
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    dispatch.add(can::kSdoRequestBase + id, false, can::Service::sdo_client,
                 static_cast<std::uint16_t>(kSdoRequest | id));
    dispatch.add(can::kSdoResponseBase + id, false, can::Service::sdo_client, id);
  }
  sleep.set_master(false, Instant{});
  if (config_.sleep.exists()) {
    dispatch.add(config_.sleep.request, false, can::Service::sleep, 0);
    dispatch.add(config_.sleep.objection, false, can::Service::sleep, 0);
  }
  if (config_.emcy_fd) {
    nodes.accept_fd_emcys();
  }
  dispatch.add(can::kNmtId, false, can::Service::nmt, 0);
  dispatch.add(can::kTimeId, false, can::Service::time, 0);
  sync.configure(sync_of(config_));
}

std::size_t ObserverLine::longest_pdo_bytes() const {
  return longest_pdo(config_) / 8;
}

const image::Layout& ObserverLine::layout(Direction direction) const {
  return side(direction).layout();
}

void ObserverLine::do_start(Instant now) {
  if (sleep.sleeps()) {
    nodes.wake(now);
  }
  sleep.reset();
  sleep.set_master(false, now);
  inputs->engine.set_operational(true, now);
  outputs->engine.set_operational(true, now);
  sync.set_active(true);
}

void ObserverLine::do_receive(std::span<const can::Frame> frames) {
  while (!frames.empty()) {
    frames = frames.subspan(inputs->engine.receive_ordinary(frames, received));
    if (!frames.empty()) {
      received.add(frames.front());
      receive(frames.front());
      frames = frames.subspan(1);
    }
  }
}

void ObserverLine::receive(const can::Frame& frame) {
  if (sleep.sleeps()) {
    sleep.hear(frame.time);
    follow_sleep();
  }
  if (dispatch_frame(frame)) {
    return;
  }
  if (is_new_pdo(frame)) {
    relink(frame.time);
    if (dispatch_frame(frame)) {
      return;
    }
  }
  ++counters_.frames_unused;
  listening.hear(frame, events_);
}

// Whether the frame is a PDO that was just configured, or one whose mapping is unknown.
bool ObserverLine::is_new_pdo(const can::Frame& frame) {
  bool is_new = false;
  for (Device& device : devices) {
    if (ends_configuration(device, frame)) {
      device.written_until = {};
      relink_at = frame.time;
      is_new = true;
    }
  }
  return is_new;
}

// A PDO that is sent is valid. After a reset, a frame does not show it if it may have been queued
// before, or if it is sent to the node, which is not started yet: a master may send its RPDOs to
// all nodes, always.
bool ObserverLine::ends_configuration(Device& device, const can::Frame& frame) const {
  if (device.resetting) {
    return false;
  }
  const bool is_found = device.pdos.hear(frame);
  if (device.written_until != kNever) {
    return is_found || (device.written_until > frame.time && device.pdos.kind_of(frame));
  }
  const auto kind = device.pdos.kind_of(frame);
  return kind == pdo::PdoKind::tpdo ||
         (kind == pdo::PdoKind::rpdo && takes_outputs(device.pdos.node()));
}

// A frame may change the tables (a mapping, an identifier): its remaining targets are then skipped.
bool ObserverLine::dispatch_frame(const can::Frame& frame) {
  bool wanted = false;
  const std::uint64_t changes = dispatch.changes();
  for (const can::Target* target = dispatch.find(frame); target != nullptr;
       target = dispatch.next(*target)) {
    wanted = true;
    serve(can::Target(*target), frame);
    if (dispatch.changes() != changes) {
      return true;
    }
  }
  for (const can::Target* target = output_dispatch.find(frame); target != nullptr;
       target = output_dispatch.next(*target)) {
    outputs->engine.receive(target->index, frame);
    if (!takes_outputs(outputs->node_of(target->index))) {
      outputs->image.set_pdo_valid(Direction::inputs,
                                   static_cast<std::uint16_t>(target->index + 1U), false);
    }
    wanted = true;
  }
  return wanted;
}

// As in the image of the master: an output is valid if it was transmitted to a node that is
// started. A node whose state was never received counts as started.
bool ObserverLine::takes_outputs(std::uint8_t id) const {
  const NodeState seen = nodes.node(id);
  return seen.presence == manager::Presence::unknown ||
         (seen.presence == manager::Presence::present && seen.state == nmt::State::operational);
}

void ObserverLine::serve(const can::Target& target, const can::Frame& frame) {
  const auto id = static_cast<std::uint8_t>(target.index);
  switch (target.service) {
    case can::Service::rpdo:
      inputs->engine.receive(target.index, frame);
      if (!frame.remote() && !sleep.sleeps()) {
        nodes.heard_pdo(inputs->node_of(target.index), frame.time);
      }
      return;
    case can::Service::error_control:
      receive_error_control(id, frame);
      return;
    case can::Service::emcy:
      if (!nodes.receive_emcy(id, frame)) {
        malformed(frame, id);
      }
      return;
    case can::Service::sdo_client:
      receive_sdo(target.index, frame);
      return;
    case can::Service::srdo:
      if (!sleep.sleeps() && srdos.receive(target.index, frame)) {
        nodes.heard_pdo(srdos.node_of(target.index), frame.time);
      }
      return;
    case can::Service::sleep:
      if (!sleep.receive(frame)) {
        malformed(frame, 0);
      }
      follow_sleep();
      return;
    case can::Service::nmt:
      receive_node_control(frame);
      return;
    case can::Service::sync:
      receive_sync(frame);
      return;
    case can::Service::time:
      receive_time(frame);
      return;
    default:
      return;
  }
}

void ObserverLine::receive_error_control(std::uint8_t id, const can::Frame& frame) {
  const nmt::ErrorControlReception reception = nodes.receive_error_control(id, frame);
  if (reception == nmt::ErrorControlReception::malformed) {
    malformed(frame, id);
  } else if (reception == nmt::ErrorControlReception::not_alternated) {
    ++counters_.frames_unused;
  }
}

void ObserverLine::receive_node_control(const can::Frame& frame) {
  if (const auto command = nmt::decode_node_control(frame)) {
    if (command->command == nmt::Command::start) {
      for (Device& device : devices) {
        if (command->addresses(device.pdos.node()) && device.written_until > frame.time) {
          device.written_until = {};
          device.resetting = false;
          relink_at = frame.time;
        }
      }
      relink(frame.time);  // before the first PDO of the node
    }
    nodes.commanded(*command, frame.time);
  } else {
    malformed(frame, 0);
  }
}

// The presence of a SYNC counter is not checked: it is a matter of the producer and the devices.
void ObserverLine::receive_sync(const can::Frame& frame) {
  if (frame.remote()) {
    return;
  }
  const sync::Reception seen = sync.receive(frame);
  if (!seen.is_sync) {
    malformed(frame, 0);
    return;
  }
  ++syncs_;
  inputs->engine.sync(0, frame.time);
}

void ObserverLine::receive_time(const can::Frame& frame) {
  if (const auto decoded = time::decode(frame)) {
    network_time = decoded;
    network_time_at = frame.time;
  } else {
    malformed(frame, 0);
  }
}

void ObserverLine::malformed(const can::Frame& frame, std::uint8_t id) {
  ++counters_.frames_malformed;
  events_.emit(can::malformed_event(frame, id));
}

// From prepare on neither PDOs nor SYNC are expected, and none makes a value valid; all frames pass
// receive(), so that each may wake the line.
void ObserverLine::set_pdos_active(bool active, Instant now) {
  inputs->engine.set_operational(active, now);
  outputs->engine.set_operational(active, now);
  sync.set_active(active);
  inputs->set_all_invalid();
  outputs->set_all_invalid();
  srdos.forget_all();
}

// It sends none of the messages.
void ObserverLine::follow_sleep() {
  for (const nmt::SleepChange& change : sleep.pop_changes()) {
    emit(change.time,
         event::SleepState{.phase = change.phase, .before = change.before, .cause = change.cause});
    if (change.phase == nmt::SleepPhase::prepare) {
      nodes.sleep();
      set_pdos_active(false, change.time);
    } else if (change.phase > nmt::SleepPhase::prepare) {
      nodes.fall_silent();
    } else if (change.phase == nmt::SleepPhase::awake &&
               change.before >= nmt::SleepPhase::prepare) {
      nodes.wake(change.time);
      set_pdos_active(true, change.time);
    }
  }
  (void)sleep.pop_frames();
}

void ObserverLine::do_bus_event(const can::BusEvent& /*event*/) {
  if (!usable()) {
    inputs->set_all_invalid();
    outputs->set_all_invalid();
    srdos.forget_all();
  }
}

bool ObserverLine::advance(Instant now) {
  events_.advance(now);
  inputs->engine.advance(now);
  nodes.advance(now);
  sync.advance(now);
  srdos.advance(now);
  sleep.advance(now);
  follow_sleep();
  if (relink_at <= now) {
    relink(now);
  }
  load_.advance(received, now);
  return true;
}

Instant ObserverLine::next_wake() const {
  const Instant wake = earlier(events_.next_wake(), inputs->engine.next_wake());
  return earlier(earlier(wake, relink_at),
                 earlier(nodes.next_wake(),
                         earlier(earlier(sync.next_wake(), srdos.next_wake()), sleep.next_wake())));
}

// All commands except can_listen would transmit, or need an own node.
void ObserverLine::do_execute(Command command, Instant now) {
  if (const auto* const listen = std::get_if<CanListen>(&command.request)) {
    answer(command, listening.ask(*listen, now), {}, now);
    return;
  }
  refuse(command, Refusal::wrong_role, now);
}

OutputRefusal ObserverLine::do_write_outputs(const OutputWrite& /*write*/, Instant /*now*/) {
  return OutputRefusal::wrong_role;
}

void ObserverLine::do_stop(Instant /*now*/) {
  inputs->set_all_invalid();
  outputs->set_all_invalid();
  srdos.forget_all();
}

void ObserverLine::snapshot(Direction direction, image::Snapshot& into, Instant now, bool merge) {
  side(direction).image.snapshot(Direction::inputs, into, now, merge, syncs_);
  if (direction == Direction::outputs) {
    std::ranges::copy(into.valid, into.known.begin());
  }
}

bool ObserverLine::image_changed(Direction direction) const {
  return side(direction).image.changed(Direction::inputs);
}

bool ObserverLine::image_touched(Direction direction) const {
  return side(direction).image.touched(Direction::inputs);
}

Line::Input ObserverLine::input(std::uint32_t entry, std::uint8_t part) const {
  const image::ProcessImage& seen = inputs->image;
  const std::uint16_t rpdo = seen.layout(Direction::inputs).entries[entry].local_pdo;
  return {.value = part == 0 ? seen.read_entry(Direction::inputs, entry)
                             : seen.read_part(Direction::inputs, entry, part),
          .valid = seen.is_valid(Direction::inputs, entry),
          .late = inputs->engine.timed_out(rpdo),
          .received = seen.area(Direction::inputs).pdo(rpdo - 1U).last,
          .pdo = rpdo};
}

std::optional<Duration> ObserverLine::network_utc(Instant now) const {
  if (!network_time) {
    return std::nullopt;
  }
  return time::to_utc(*network_time) + (now - network_time_at);
}

LineState ObserverLine::do_state() const {
  LineState out;
  out.role = config_.role;
  out.network_id = config_.network_id;
  out.own_state = nmt::State::unknown;  // there is no own node
  out.bus = bus_;
  out.transmit_errors = transmit_errors_;
  out.receive_errors = receive_errors_;
  out.load_permille = load_.permille();
  out.nodes_configured = nodes.configured();
  out.nodes_operational = nodes.operational();
  out.counters = counters_;
  out.srdos = srdos.counters();
  if (config_.sleep.exists()) {
    out.sleep = sleep.phase();
  }
  pdo::EngineCounters from_devices = inputs_before;
  pdo::EngineCounters to_devices = outputs_before;
  add(from_devices, inputs->engine.counters());
  add(to_devices, outputs->engine.counters());
  out.counters.frames_received = received.frames;
  out.counters.frames_malformed +=
      from_devices.too_short + from_devices.too_long + to_devices.too_short + to_devices.too_long;
  out.counters.rpdos = from_devices.received + to_devices.received;
  out.counters.receptions_lost = from_devices.receptions_lost;
  out.counters.syncs = syncs_;
  out.counters.emcys = nodes.emcys();
  out.counters.heartbeats_lost = nodes.heartbeats_lost();
  out.counters.events = events_.emitted();
  out.counters.events_lost = events_.lost();
  return out;
}

std::uint64_t ObserverLine::do_node_revision(std::uint8_t id) const {
  return nodes.revision(id);
}

NodeState ObserverLine::do_node_state(std::uint8_t id) const {
  return nodes.node(id);
}

// Both directions become invalid: in its present state the node has not received its outputs.
void ObserverLine::node_data_invalid(std::uint8_t id) {
  inputs->image.set_node_valid(id, false);
  inputs->engine.drop_waiting(id);
  outputs->image.set_node_valid(id, false);
  srdos.forget(id);
}

void ObserverLine::node_reset(std::uint8_t id) {
  usdo.reset(id);
  if (Device* const device = find(id)) {
    device->pdos.reset();
    follow_reset(*device, false);
  }
}

void ObserverLine::node_booted(std::uint8_t id) {
  usdo.reset(id);
  follow_boot_up(id);
  if (Device* const device = find(id)) {
    device->pdos.boot_up();
    follow_reset(*device, true);
  }
}

}  // namespace linegate::line
