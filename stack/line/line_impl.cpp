// SPDX-License-Identifier: Apache-2.0
#include "stack/line/line_impl.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/malformed.h"
#include "stack/line/build.h"
#include "stack/line/own_dictionary.h"
#include "stack/time/service.h"

namespace linegate::line {
namespace {

// Marks the targets of the manager's consumers apart from those of the own node's.
constexpr std::uint16_t kManagerMark = 128;

std::uint8_t node_of(const can::Target& target) {
  return static_cast<std::uint8_t>(target.index & 0x7FU);
}

node::Options node_options(const LineConfig& config) {
  return {.node_id = config.node_id,
          .self_starting = false,
          .nmt_slave = config.role == Role::device,
          .clients_of_default_servers = false,  // the arbiter reaches them
          .error_scheme = config.error_scheme};
}

od::Dictionary dictionary_of(const LineConfig& config, image::ProcessImage& image,
                             const pdo::LinkPlan& plan, OwnObjects& own,
                             routing::ForwardObjects& forwarded) {
  od::Dictionary dictionary = make_own_dictionary(config);
  (void)own.add_to(dictionary).ok();  // they were checked
  // Cannot fail: the own dictionary has none of these objects yet.
  (void)pdo::add_linked_objects(dictionary, image, plan).ok();
  (void)forwarded.add_to(dictionary).ok();
  (void)diagnosis::add_objects(dictionary).ok();
  (void)diagnosis::add_canopen_ia(dictionary, config.canopen_ia_base).ok();
  return dictionary;
}

}  // namespace

Line::Impl::Impl(LineConfig line_config, pdo::LinkPlan link_plan)
    : Base(std::move(line_config)),
      plan(std::move(link_plan)),
      image(plan.inputs, plan.outputs),
      own_objects(config.own_objects, image, events),
      forwarded(config.forwarding, image),
      node(dictionary_of(config, image, plan, own_objects, forwarded), node_options(config), events,
           &image),
      nmt(node.transmit(), &node.dictionary()),
      heartbeats(node.dispatch(), events, kManagerMark, &node.transmit()),
      emergencies(node.dispatch(), events, kManagerMark),
      sdo(node.dispatch(), node.transmit(), events),
      configurator(node.dictionary(), node_plans(config), sdo, events, config.sdo_timeout),
      loader(node.dictionary(), node_plans(config), sdo, events, config.sdo_timeout,
             static_cast<std::uint32_t>(CommandKind::program)),
      manager(node_plans(config), manager_options(config), node.dictionary(), sdo, heartbeats,
              events, *this),
      startup(node.dictionary(), config.node_id, manager, *this),
      lss(*this, config, manager,
          {.manager = manager, .sdo = sdo, .heartbeats = heartbeats, .host = *this}, plan.rpdos,
          events),
      scanning(*this, config,
               {.sdo = sdo,
                .manager = manager,
                .nmt = *this,
                .diagnosing = diagnosing,
                .records = records,
                .events = events}),
      routing(*this, config, node, sdo, events, messages, routed),
      pdo_requests(*this, node, image, plan, config.sdo_timeout),
      booting(*this, manager, config.node_id),
      configuring(*this, manager, configurator, events),
      programming(*this, manager, loader, config.node_id),
      diagnosing(*this, config, node, manager, scanning, events),
      records(*this, config,
              {.node = node,
               .diagnosis = diagnosing.diagnosis(),
               .nmt = *this,
               .scanning = scanning,
               .orders = *this,
               .load = load,
               .plan = plan}),
      outputs(image.layout(image::Direction::outputs), config.groups, config.bound),
      updates(config.pdo_update_time) {
  sdo.follow(under_way.requests());
  node.emcy().set_reporter(&emcy_reporter);
  node.set_companion(this);
  node.show_monitored(&heartbeats);
  manager.set_program_step([this](std::uint8_t id) { return loader.make_step(id); });
  manager.set_configuration_step([this](std::uint8_t id) { return configurator.make_step(id); });
  for (Service* service : services) {
    for (const CommandKind kind : service->commands()) {
      service_of[static_cast<std::size_t>(kind)] = service;
    }
  }
  node.pdos().link(plan);
  for (const pdo::Parameters& own : config.forwarding.tpdos) {
    node.pdos().set_auto_notify(own.number, own.mpdo == pdo::MpdoMode::source);
  }
  find_scanned_outputs();
  node.clock().produce_every(config.time_period);
  sdo.set_slow_writes(config.save_timeout, config.load_timeout);
  heartbeats.set_listener(this);
  heartbeats.listen_all(config.node_id);
  emergencies.set_listener(this);
  emergencies.listen_all(config.node_id);
  for (const NodeConfig& device : config.nodes) {
    emergencies.listen(device.id, emcy_cob_id(device));
    sdo.set_block_from(device.id, device.block_from);
  }
}

void Line::Impl::start(Instant now) {
  running = true;
  emit(EventKind::line_started, now, static_cast<std::uint32_t>(config.role));
  report_found_layout(now);
  receivers_changed = true;
  follow_receivers();
  node.start(now);
  apply_defaults(now);
  take_role(now);
}

// Those that knew the line before have another layout.
void Line::Impl::report_found_layout(Instant now) {
  if (config.scanned.empty()) {
    return;
  }
  Event event{.time = now, .kind = EventKind::layout_changed, .length = 16};
  store_le(event.data.data(), layout(image::Direction::inputs).id);
  store_le(event.data.data() + 8, layout(image::Direction::outputs).id);
  events.emit(event);
}

void Line::Impl::take_completions(Instant now) {
  sdo.deliver_completions(now);
  if (configuring.active()) {
    configuring.advance(now);
  }
  if (programming.active()) {
    programming.advance(now);
  }
}

void Line::Impl::deliver(const routing::Message& message, Instant now) {
  if (routing.takes_part()) {
    routing.deliver(message, now);
  } else {
    Base::deliver(message, now);
  }
}

void Line::Impl::set_routes(const routing::Config& wanted) {
  routing.set_routes(wanted);
}

void Line::Impl::routes(std::vector<routing::Route>& out) const {
  out.clear();
  routing.routes(out);
}

[[gnu::hot]] bool Line::Impl::next_frame(can::Frame& out, Instant now) {
  const std::uint64_t number = under_way.next_number();
  bool given = false;
  if (lss.wants_to_send()) [[unlikely]] {
    stirred = true;
    given = node.next_frame(out, now, number) || lss.next_frame(out, number, now);
  } else {
    given = node.next_frame(out, now, number);
  }
  if (given && lss.listens()) [[unlikely]] {
    lss.handed_out(out, number, now);
  }
  if (given && !scanned_outputs.empty()) [[unlikely]] {
    scanned_handed_out(out, number);
  }
  if (given && number != 0) {
    note_nmt(out, number);
    note_handed_out(out, now);
  }
  return given;
}

void Line::Impl::bus_event(const can::BusEvent& event) {
  if (!note(event)) {
    return;
  }
  receivers_changed = true;
  node.bus_event(event);
  if (!usable()) {
    interface_lost();
  }
}

void Line::Impl::malformed(const can::Target& target, const can::Frame& frame) {
  ++counters.frames_malformed;
  events.emit(can::malformed_event(frame, node_of(target)));
}

void Line::Impl::receive(const can::Target& target, const can::Frame& frame) {
  stirred = true;
  switch (target.service) {
    case can::Service::error_control:
      if (!frame.remote() && !heartbeats.receive(node_of(target), frame)) {
        malformed(target, frame);
      }
      return;
    case can::Service::emcy:
      if (!emergencies.receive(node_of(target), frame)) {
        malformed(target, frame);
      }
      return;
    case can::Service::nmt:
      hear_nmt(target.index, frame);
      return;
    case can::Service::sdo_client:
      sdo.receive(target, frame);
      take_completions(frame.time);
      return;
    case can::Service::lss:
      if (!lss.receive(frame)) {
        malformed(target, frame);
      }
      return;
    default:
      return;
  }
}

void Line::Impl::synced(Instant /*now*/) {
  ++syncs;
}

void Line::Impl::unwanted(const can::Frame& frame) {
  stirred = true;
  listening.hear(frame, events, records.hear(frame));
}

void Line::Impl::emergency(std::uint8_t id, const emcy::Message& message, Instant now) {
  diagnosing.diagnosis().emergency(id, message);
  manager.emergency(id, message.code, message.error_register, now);
  routing.emergency(id, message, now);
}

// The nodes keep their state, as a PLC's devices do when it is switched off; what the own node
// sent ends with its heartbeat.
void Line::Impl::stop(Instant now) {
  if (!std::exchange(running, false)) {
    return;
  }
  manager.stop(now);
  follow_receivers();
  cancel_sendings();
  for (Service* service : services) {
    service->end(Refusal::cancelled, now);
  }
  for (Pending& command : pending) {
    sdo.cancel(command_transfers, command.node, command.number);
    reply(command.tag, to_error(Refusal::cancelled));
  }
  pending.clear();
  for (LocalWrite& write : local_writes) {
    node.dictionary().cancel(write.ticket);
    reply(write.tag, to_error(Refusal::cancelled));
  }
  local_writes.clear();
  if (manages() && config.stop_nodes) {
    nmt.send(nmt::Command::enter_pre_operational, 0, now);
    manager.sent(nmt::Command::enter_pre_operational, 0, now);
  }
  node.command(nmt::Command::enter_pre_operational, now);
  emit(EventKind::line_stopped, now);
}

// Lines without routing pay for the question alone: nothing is kept for afterwards.
[[gnu::hot]] void Line::Impl::receive(std::span<const can::Frame> frames) {
  own_objects.pass_time(frames.empty() ? advanced_to : frames.back().time);
  if (lss.listens()) [[unlikely]] {
    stirred = true;
    lss.hear(frames);
  }
  if (!routing.takes_part()) {
    node.receive(frames);
    return;
  }
  receive_and_route(frames);
}

// PDOs concern no route.
void Line::Impl::receive_and_route(std::span<const can::Frame> frames) {
  const std::uint64_t served = node.served();
  node.receive(frames);
  if (node.served() != served) {
    stirred = true;
    routing.hand_on(frames.back().time);
  }
}
bool Line::Impl::wants_to_send(Instant now) const {
  return node.wants_to_send(now) || lss.wants_to_send();
}
const image::Layout& Line::Impl::layout(image::Direction direction) const {
  return image.layout(direction);
}
void Line::Impl::snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                          bool merge) {
  image.snapshot(direction, into, now, merge, syncs);
}
[[gnu::hot]] bool Line::Impl::image_changed(image::Direction direction) const {
  return image.changed(direction);
}
[[gnu::hot]] bool Line::Impl::image_touched(image::Direction direction) const {
  return image.touched(direction);
}
bool Line::Impl::request_pdo(std::uint16_t rpdo) {
  return usable() && node.pdos().request_rpdo(rpdo);
}
void Line::Impl::set_utc(Duration offset) {
  node.clock().set_utc(offset);
}
std::optional<Duration> Line::Impl::network_utc(Instant now) const {
  return node.clock().network_utc(now);
}
void Line::Impl::set_medium(storage::Medium* medium, std::uint8_t /*device*/) {
  node.set_medium(medium);
}
void Line::Impl::medium_done(bool good, std::uint8_t /*device*/) {
  node.medium_done(good);
}
od::Dictionary& Line::Impl::dictionary() {
  return node.dictionary();
}

Line::Input Line::Impl::input(std::uint32_t entry) const {
  using image::Direction;
  if ((entry & kForwarded) != 0) {
    return forwarded_input(entry & ~kForwarded);
  }
  const std::uint16_t rpdo = image.layout(Direction::inputs).entries[entry].local_pdo;
  return {.value = image.read_entry(Direction::inputs, entry),
          .valid = image.is_valid(Direction::inputs, entry),
          .late = rpdo != 0 && node.pdos().timed_out(rpdo),
          .received = rpdo == 0 ? Instant{} : image.area(Direction::inputs).pdo(rpdo - 1U).last,
          .pdo = rpdo};
}

}  // namespace linegate::line
