// SPDX-License-Identifier: Apache-2.0
#include "stack/line/line.h"

#include <algorithm>
#include <utility>

#include "stack/can/malformed.h"
#include "stack/line/build.h"
#include "stack/line/devices.h"
#include "stack/line/line_impl.h"
#include "stack/line/observer.h"
#include "stack/line/own_dictionary.h"
#include "stack/nmt/services.h"
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
      lss(config, {.manager = manager, .sdo = sdo, .heartbeats = heartbeats, .host = *this},
          plan.rpdos, events),
      startup(node.dictionary(), config.node_id, manager, *this),
      configuring(manager, configurator, events),
      programming(manager, loader),
      diagnosis(diagnosis_options(config), node.dictionary(), *this),
      foreign_manager(node.dispatch(), events),
      canopen_ia(node.dictionary(), diagnosis, *this, canopen_ia_options(config)),
      diagnosis_objects(node.dictionary(), diagnosis, config.node_id),
      outputs(image.layout(image::Direction::outputs), config.groups, config.bound),
      updates(config.pdo_update_time),
      scanner(sdo, events, *this) {
  events.set_listener(&diagnosis);
  sdo.follow(under_way.requests());
  node.emcy().set_reporter(&emcy_reporter);
  node.set_companion(this);
  node.show_monitored(&heartbeats);
  manager.set_program_step([this](std::uint8_t id) { return loader.make_step(id); });
  manager.set_configuration_step([this](std::uint8_t id) { return configurator.make_step(id); });
  configurator.objects().set_may_configure([this](std::uint8_t id) { return may_configure(id); });
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
  scan_cache = config.scanned;
  emergencies.listen_all(config.node_id);
  for (const NodeConfig& device : config.nodes) {
    emergencies.listen(device.id, emcy_cob_id(device));
    sdo.set_block_from(device.id, device.block_from);
  }
  if (config.routing.interface != 0) {
    routing = std::make_unique<Routing>(config, node, sdo, events, messages, routed);
  }
}

void Line::Impl::start(Instant now) {
  running = true;
  emit(EventKind::line_started, now, static_cast<std::uint32_t>(config.role));
  tell_found_layout(now);
  receivers_changed = true;
  follow_receivers();
  node.start(now);
  apply_defaults(now);
  take_role(now);
}

void Line::Impl::take_completions(Instant now) {
  sdo::Completion completion;
  while (sdo.take(completion)) {
    if ((completion.token & manager::kManagerToken) != 0) {
      manager.completed(completion, now);
    } else if ((completion.token & scan::kScanToken) != 0) {
      scanner.completed(completion, now);
      finish_scan();
    } else if ((completion.token & manager::kTaskToken) != 0) {
      if (!configurator.completed(completion, now)) {
        (void)loader.completed(completion, now);
      }
    } else if ((completion.token & kCheckToken) != 0) {
      lss.completed(completion, now);
    } else {
      command_completed(completion);
    }
  }
  while (routing != nullptr && routing->take(completion)) {
    command_completed(completion);
  }
  if (configuring.active()) {
    advance_configure(now);
  }
  if (programming.active()) {
    advance_program(now);
  }
}

bool Line::Impl::may_send_sdo() const {
  return running && usable() && nmt::is_served(can::Service::sdo_client, node.state());
}

void Line::Impl::deliver(const routing::Message& message, Instant now) {
  if (routing == nullptr) {
    Base::deliver(message, now);
    return;
  }
  routing->deliver(message, may_send_sdo(), now);
  take_completions(now);
}

void Line::Impl::set_routes(const routing::Config& wanted) {
  if (routing == nullptr) {
    return;
  }
  config.routing.interfaces = wanted.interfaces;
  config.routing.routes = wanted.routes;
  config.routing.emcy_networks = wanted.emcy_networks;
  for (const od::ObjectDescription& table : routing_tables(config)) {
    (void)node.dictionary().remove(table.index);
    (void)node.dictionary().add(table);
  }
  routing->tables_changed();
}

void Line::Impl::routes(std::vector<routing::Route>& out) const {
  out.clear();
  if (routing != nullptr) {
    routing->routes(out);
  }
}

[[gnu::hot]] bool Line::Impl::next_frame(can::Frame& out, Instant now) {
  const std::uint64_t number = under_way.next_number();
  bool given = false;
  if (lss.wants_to_send()) [[unlikely]] {
    stirred = true;
    given = node.next_frame(out, now, number) || next_lss_frame(out, number, now);
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
      settle_lss(frame.time);
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
  listening.hear(frame, events, canopen_ia.hear(frame));
}

void Line::Impl::emergency(std::uint8_t id, const emcy::Message& message, Instant now) {
  diagnosis.emergency(id, message);
  manager.emergency(id, message.code, message.error_register, now);
  if (routing != nullptr) {
    routing->emergency(id, message, now);
  }
}

// The nodes keep their state, as a PLC's devices do when it is switched off; what the own node
// sent ends with its heartbeat.
void Line::Impl::stop(Instant now) {
  if (!std::exchange(running, false)) {
    return;
  }
  manager.stop(now);
  follow_receivers();
  lss.stop();
  settle_lss(now);
  cancel_pdo_requests();
  cancel_sendings();
  end_scan(Refusal::cancelled, now);
  end_boots(Refusal::cancelled);
  end_configure(Refusal::cancelled);
  end_program(Refusal::cancelled, now);
  if (routing != nullptr) {
    routing->stop(now);
    take_completions(now);
  }
  for (Pending& command : pending) {
    sdo.cancel(command.token);
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
  if (routing == nullptr) {
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
    routing->settle(may_send_sdo(), frames.back().time);
    take_completions(frames.back().time);
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

// --- Line ---------------------------------------------------------------------------------------

Loaded<std::unique_ptr<Line>> Line::make(LineConfig config) {
  Loaded<std::unique_ptr<Line>> out;
  out.diagnostics = check(config);
  if (has_errors(out.diagnostics)) {
    return out;
  }
  const bool has_devices = !config.devices.empty();
  Loaded<pdo::LinkPlan> plan = has_devices ? device_plan(config) : link_plan(config);
  out.diagnostics.insert(out.diagnostics.end(), plan.diagnostics.begin(), plan.diagnostics.end());
  if (!plan.ok()) {
    return out;
  }
  if (has_devices || config.role == Role::observer) {
    config.own_objects.clear();  // they have no such dictionary
  } else if (!place_own_objects(config, *plan.value)) {
    out.diagnostics.push_back({Severity::error, config.name, 0, 0,
                               "own objects in the image: an area would have more than " +
                                   std::to_string(image::kMaxAreaBytes) + " bytes"});
    return out;
  }
  const std::vector<Diagnostic> wrong = check_outputs(config, plan.value->outputs);
  out.diagnostics.insert(out.diagnostics.end(), wrong.begin(), wrong.end());
  if (has_errors(out.diagnostics)) {
    return out;
  }
  if (has_devices || config.role == Role::observer) {
    config.forwarding = {};  // they have no dictionary for it
  } else {
    const auto faults = routing::check(config.forwarding, *plan.value, config.name);
    out.diagnostics.insert(out.diagnostics.end(), faults.begin(), faults.end());
    if (has_errors(faults)) {
      return out;
    }
    routing::show_in_records(config.forwarding, *plan.value);
  }
  std::unique_ptr<Base> role;
  if (has_devices) {
    role = std::make_unique<Devices>(std::move(config), *std::move(plan.value));
  } else if (config.role == Role::observer) {
    role = std::make_unique<Observer>(std::move(config), *std::move(plan.value));
  } else {
    role = std::make_unique<Impl>(std::move(config), *std::move(plan.value));
  }
  out.value.emplace(new Line(std::move(role)));
  return out;
}

Line::Line(std::unique_ptr<Base> impl) : impl_(std::move(impl)) {
}
Line::~Line() = default;

const LineConfig& Line::config() const {
  return impl_->config;
}
const image::Layout& Line::layout(image::Direction direction) const {
  return impl_->layout(direction);
}

std::uint64_t Line::layout_revision() const {
  return impl_->layout_revision();
}

void Line::start(Instant now) {
  impl_->stir(now);
  impl_->start(now);
}

[[gnu::hot]] void Line::receive(std::span<const can::Frame> frames, Instant /*now*/) {
  if (impl_->load.wants_fast()) [[unlikely]] {
    impl_->receive_counted(frames);
  } else {
    impl_->receive(frames);
  }
}

void Line::set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate) {
  const std::uint32_t configured = impl_->config.bit_rate;
  impl_->load.set_bit_rates(configured != 0 ? configured : bit_rate, data_bit_rate);
}

void Line::bus_event(const can::BusEvent& event) {
  impl_->stir();
  impl_->bus_event(event);
}
void Line::report(const Event& event) {
  impl_->events.emit(event);
  if (event.kind == EventKind::output_refused) {
    impl_->note_refused(static_cast<std::uint16_t>(event.value),
                        static_cast<OutputRefusal>(event.code), event.time);
  }
}
std::size_t Line::output_groups() const {
  return impl_->output_groups();
}
void Line::output_state(std::size_t position, OutputState& out) const {
  impl_->output_state(position, out);
}
void Line::set_medium(storage::Medium* medium, std::uint8_t device) {
  impl_->stir();
  impl_->set_medium(medium, device);
}
void Line::medium_done(bool good, std::uint8_t device) {
  impl_->stir();
  impl_->medium_done(good, device);
}
[[gnu::hot]] void Line::advance(Instant now) {
  impl_->advance(now);
}
void Line::execute(Command command, Instant now) {
  impl_->stir(now);
  impl_->execute(std::move(command), now);
}

OutputRefusal Line::write_outputs(const OutputWrite& write, Instant now) {
  impl_->stir(now);
  return impl_->write_outputs(write, now);
}

[[gnu::hot]] void Line::write_bound(std::span<const BoundValue> values, Instant now) {
  impl_->write_bound(values, now);
}
[[gnu::hot]] Line::Input Line::input(std::uint32_t entry) const {
  return impl_->input(entry);
}

void Line::deliver(const routing::Message& message, Instant now) {
  impl_->stir(now);
  impl_->deliver(message, now);
}
void Line::set_routes(const routing::Config& wanted, Instant now) {
  impl_->stir(now);
  impl_->set_routes(wanted);
}
bool Line::take_message(routing::Message& out) {
  return impl_->messages.pop(out);
}

void Line::stop(Instant now) {
  impl_->stir(now);
  impl_->stop(now);
}

[[gnu::hot]] Instant Line::next_wake() const {
  return impl_->next_wake();
}
[[gnu::hot]] bool Line::next_frame(can::Frame& out, Instant now) {
  return impl_->load.wants_fast() ? impl_->next_counted(out, now) : impl_->next_frame(out, now);
}
bool Line::wants_to_send(Instant now) const {
  return impl_->wants_to_send(now);
}
[[gnu::hot]] bool Line::has_news() const {
  return !impl_->events.empty() || !impl_->replies.empty();
}
std::size_t Line::take_events(std::span<Event> out) {
  return impl_->events.take(out);
}

bool Line::take_reply(Reply& out) {
  if (impl_->replies.empty()) {
    return false;
  }
  out = std::move(impl_->replies.front());
  impl_->replies.pop_front();
  return true;
}

void Line::snapshot(image::Direction direction, image::Snapshot& into, Instant now, bool merge) {
  impl_->snapshot(direction, into, now, merge);
}

bool Line::request_pdo(std::uint16_t rpdo) {
  impl_->stir();
  return impl_->request_pdo(rpdo);
}
[[gnu::hot]] bool Line::image_changed(image::Direction direction) const {
  return impl_->image_changed(direction);
}
[[gnu::hot]] bool Line::image_touched(image::Direction direction) const {
  return impl_->image_touched(direction);
}
std::optional<OwnDevice> Line::own_device(std::uint8_t node) const {
  return impl_->own_device(node);
}
node::Indicators Line::indicators() const {
  return impl_->indicators();
}
void Line::set_utc(Duration offset) {
  impl_->set_utc(offset);
}
std::optional<Duration> Line::network_utc(Instant now) const {
  return impl_->network_utc(now);
}
std::uint32_t Line::sync_count() const {
  return impl_->syncs;
}

void Line::routes(std::vector<routing::Route>& out) const {
  impl_->routes(out);
}

LineState Line::state() const {
  LineState out = impl_->state();
  out.routing = impl_->routed;
  return out;
}
std::uint64_t Line::node_revision(std::uint8_t node) const {
  return node < 128 ? impl_->node_revision(node) : 0;
}
NodeState Line::node_state(std::uint8_t node) const {
  return node < 128 ? impl_->node_state(node) : NodeState{};
}
od::Dictionary& Line::dictionary() {
  impl_->stir();  // whoever asks may write
  return impl_->dictionary();
}
const od::Dictionary& Line::dictionary() const {
  return impl_->dictionary();
}

}  // namespace linegate::line
