// SPDX-License-Identifier: Apache-2.0
#include "stack/line/node_line.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/dispatch.h"
#include "stack/line/build.h"
#include "stack/line/own_dictionary.h"
#include "stack/manager/network_list.h"
#include "stack/time/service.h"
#include "stack/usdo/client.h"

namespace linegate::line {
namespace {

// Distinguishes the targets of the manager's consumers from those of the own node.
constexpr std::uint16_t kManagerMark = 128;

std::uint8_t node_of(const can::Target& target) {
  return static_cast<std::uint8_t>(target.index & 0x7FU);
}

node::Options node_options(const LineConfig& config) {
  return {.node_id = config.node_id,
          .self_starting = false,
          .nmt_slave = config.role == Role::device || config.flying_master.has_value(),
          .clients_of_default_servers = false,  // the arbiter accesses them
          .error_scheme = config.error_scheme,
          .fd = config.canopen_fd,
          .usdo_abort = config.usdo_abort,
          .emcy_fd = config.emcy_fd};
}

od::Dictionary dictionary_of(const LineConfig& config, image::ProcessImage& image,
                             const pdo::LinkPlan& plan, OwnObjects& own,
                             routing::ForwardObjects& forwarded) {
  od::Dictionary dictionary = make_own_dictionary(config);
  LINEGATE_ASSERT(own.add_to(dictionary).ok(), "own objects were checked");
  LINEGATE_ASSERT(pdo::add_linked_objects(dictionary, image, plan).ok(), "none is there yet");
  LINEGATE_ASSERT(forwarded.add_to(dictionary).ok(), "forwarded objects were checked");
  LINEGATE_ASSERT(diagnosis::add_objects(dictionary).ok(), "none is there yet");
  LINEGATE_ASSERT(diagnosis::add_canopen_ia(dictionary, config.canopen_ia_base).ok(),
                  "the base was checked");
  return dictionary;
}

}  // namespace

NodeLine::NodeLine(LineConfig line_config, pdo::LinkPlan link_plan)
    : Line(std::move(line_config)),
      plan_(std::move(link_plan)),
      image_(plan_.inputs, plan_.outputs),
      own_objects_(config_.own_objects, image_, events_),
      forwarded_(config_.forwarding, image_),
      node_(dictionary_of(config_, image_, plan_, own_objects_, forwarded_), node_options(config_),
            events_, &image_),
      nmt_(node_.transmit(), &node_.dictionary()),
      heartbeats_(node_.dispatch(), events_, kManagerMark, &node_.transmit()),
      emergencies_(node_.dispatch(), events_, kManagerMark),
      sdo_(node_.dispatch(), node_.transmit(), events_),
      configurator_(node_.dictionary(), node_plans(config_), sdo_, events_, config_.sdo_timeout),
      loader_(node_.dictionary(), node_plans(config_), sdo_, events_, config_.sdo_timeout,
              CommandKind::program),
      manager_(node_plans(config_), manager_options(config_), node_.dictionary(), sdo_, heartbeats_,
               events_, *this),
      startup_(node_.dictionary(), config_.node_id, manager_, *this) {
  sdo_.follow(under_way_.requests());
  if (config_.canopen_fd) {
    startup_.keep_role(config_.role == Role::manager);
    sdo_.set_clients([this](std::uint8_t node) {
      auto client = std::make_unique<usdo::Client>(config_.node_id, node, config_.usdo_abort);
      client->follow(under_way_.requests());
      return client;
    });
  }
  node_.emcy().set_reporter(&emcy_reporter_);
  node_.set_master_services(this);
  node_.show_monitored(&heartbeats_);
  manager_.set_program_step([this](std::uint8_t id) { return loader_.make_step(id); });
  manager_.set_configuration_step([this](std::uint8_t id) { return configurator_.make_step(id); });
  for (Service* service : services()) {
    for (const CommandKind kind : service->commands()) {
      Service*& place = service_of_[index_of(kind)];
      LINEGATE_ASSERT(place == nullptr, "a command belongs to one service");
      place = service;
    }
  }
  LINEGATE_ASSERT(std::ranges::find(service_of_, nullptr) == service_of_.end(),
                  "each command belongs to a service");
  node_.pdos().link(plan_);
  for (const pdo::Parameters& own : config_.forwarding.tpdos) {
    node_.pdos().set_auto_notify(own.number, own.mpdo == pdo::MpdoMode::source);
  }
  node_.clock().produce_every(config_.time_period);
  sdo_.set_slow_writes(config_.save_timeout, config_.load_timeout);
  heartbeats_.set_listener(this);
  heartbeats_.listen_all(config_.node_id);
  emergencies_.set_listener(this);
  if (config_.emcy_fd) {
    emergencies_.accept_fd();
  }
  emergencies_.listen_all(config_.node_id);
  for (const NodeConfig& device : config_.nodes) {
    emergencies_.listen(device.id, emcy_cob_id(device));
    sdo_.set_block_from(device.id, device.block_from);
  }
}

void NodeLine::do_start(Instant now) {
  if (services_.sleep.start()) {
    node_.resume();
    manager_.wake(now);
  }
  follow_bus(false, now);
  report_found_layout(now);
  services_.receivers.mark_changed();
  services_.receivers.follow();
  node_.start(now);
  if (config_.flying_master) {
    services_.outputs.give_up(now);  // those of the time before it was stopped
  }
  services_.outputs.apply_defaults(now);
  services_.flying.start(now);
  adopt_role(now);
}

// Subscribers must reload the layout of a line that was made anew from a scan.
void NodeLine::report_found_layout(Instant now) {
  if (config_.scanned.empty()) {
    return;
  }
  emit(now, event::LayoutChanged{.inputs = layout(image::Direction::inputs).id,
                                 .outputs = layout(image::Direction::outputs).id});
}

void NodeLine::process_completions(Instant now) {
  sdo_.deliver_completions(now);
  if (services_.configure.active()) {
    services_.configure.advance(now);
  }
  if (services_.program.active()) {
    services_.program.advance(now);
  }
}

void NodeLine::do_deliver(const routing::Message& message, Instant now) {
  if (services_.routing.takes_part() && services_.sleep.may_transmit()) {
    services_.routing.deliver(message, now);
  } else {
    reject(message);
  }
}

void NodeLine::do_set_routes(const routing::Config& wanted) {
  services_.routing.set_routes(wanted);
}

void NodeLine::set_present_gateways(std::vector<routing::GatewayLine> present) {
  services_.routing.set_present_gateways(std::move(present));
}

bool NodeLine::pop_gateway_request(routing::GatewayRequest& out) {
  return services_.routing.pop_gateway_request(out);
}

void NodeLine::do_answer_gateway_request(routing::GatewayAnswer answer, Instant now) {
  services_.routing.answer_gateway_request(std::move(answer), now);
}

void NodeLine::routes(std::vector<routing::Route>& out) const {
  out.clear();
  services_.routing.routes(out);
}

[[gnu::hot]] bool NodeLine::do_next_frame(can::Frame& out, Instant now) {
  if (!services_.sleep.may_transmit()) [[unlikely]] {
    return false;
  }
  const bool cut_off = is_cut_off(now);
  if (cut_off && !services_.flying.may_probe(now)) [[unlikely]] {
    return false;
  }
  const std::uint64_t number = under_way_.next_number();
  bool given = false;
  if (services_.lss.wants_to_send()) [[unlikely]] {
    dirty_ = true;
    given = node_.next_frame(out, now, number) || services_.lss.next_frame(out, number, now);
  } else {
    given = node_.next_frame(out, now, number);
  }
  if (given && services_.lss.listens()) [[unlikely]] {
    services_.lss.handed_out(out, number, now);
  }
  if (given && cut_off) [[unlikely]] {
    services_.flying.probed(now);
  }
  if (given && services_.sleep.awaits_acknowledge()) [[unlikely]] {
    dirty_ = true;
    services_.sleep.handed_out(out, number, now);
  }
  if (given && number != 0) {
    services_.receivers.handed_out(out, number);
    note_handed_out(out, now);
  }
  return given;
}

void NodeLine::do_bus_event(const can::BusEvent& event) {
  services_.receivers.mark_changed();
  node_.bus_event(event);
  if (!usable()) {
    services_.sleep.interface_lost(event.time);
    interface_lost();
  }
  follow_bus(sleeps(), event.time);
}

void NodeLine::malformed(const can::Target& target, const can::Frame& frame) {
  ++counters_.frames_malformed;
  events_.emit(can::malformed_event(frame, node_of(target)));
}

void NodeLine::receive_error_control(const can::Target& target, const can::Frame& frame) {
  const nmt::ErrorControlReception reception = heartbeats_.receive(node_of(target), frame);
  if (reception == nmt::ErrorControlReception::malformed) {
    malformed(target, frame);
  } else if (reception == nmt::ErrorControlReception::not_alternated) {
    ++counters_.frames_unused;
  }
}

void NodeLine::receive(const can::Target& target, const can::Frame& frame) {
  dirty_ = true;
  switch (target.service) {
    case can::Service::error_control:
      if (!frame.remote()) {
        receive_error_control(target, frame);
      }
      return;
    case can::Service::emcy:
      if (!emergencies_.receive(node_of(target), frame)) {
        malformed(target, frame);
      }
      return;
    case can::Service::nmt:
      hear_nmt(target, frame);
      return;
    case can::Service::sdo_client:
      sdo_.receive(target, frame);
      process_completions(frame.time);
      return;
    case can::Service::srdo:
      if (!sleeps() && !services_.receivers.unlike()[services_.srdos.node_of(target.index)]) {
        services_.srdos.receive(target.index, frame);
      }
      return;
    case can::Service::sleep:
      if (!services_.sleep.receive(frame)) {
        malformed(target, frame);
      }
      return;
    case can::Service::lss:
      if (!services_.lss.receive(frame)) {
        malformed(target, frame);
      }
      return;
    default:
      return;
  }
}

void NodeLine::synced(Instant now) {
  ++syncs_;
  services_.pdo_rule.synced(now);
}

void NodeLine::unwanted(const can::Frame& frame) {
  dirty_ = true;
  services_.connections.hear(frame);
  services_.can.hear(frame, services_.records.hear(frame));
}

void NodeLine::emergency(std::uint8_t id, const emcy::Message& message, Instant now) {
  services_.diagnosis.diagnosis().emergency(id, message);
  manager_.emergency(id, message.code, message.error_register, now);
  services_.routing.emergency(id, message, now);
}

// The nodes keep their outputs, like the devices of a PLC that is switched off; the own node stops
// transmitting with its heartbeat.
void NodeLine::do_stop(Instant now) {
  const bool cut_off = is_cut_off(now);
  services_.flying.stop(now);
  manager_.stop(now);
  services_.receivers.follow();
  cancel_sendings();
  for (Service* service : services()) {
    service->end(Refusal::cancelled, now);
  }
  if (manages() && config_.stop_nodes && !cut_off) {
    stop_nodes(now);
  }
  node_.command(nmt::Command::enter_pre_operational, now);
}

// The next flying master takes keep-alive nodes over as they are.
void NodeLine::stop_nodes(Instant now) {
  constexpr auto kCommand = nmt::Command::enter_pre_operational;
  const auto stop = [this, now](std::uint8_t id) {
    nmt_.send(kCommand, id, now);
    manager_.sent(kCommand, id, now);
  };
  if (!services_.flying.takes_part()) {
    stop(0);
    return;
  }
  using namespace manager::assignment;
  const manager::NetworkList list(node_.dictionary());
  for (const NodeConfig& device : config_.nodes) {
    if (!list.has(device.id, kListed | kKeepAlive)) {
      stop(device.id);
    }
  }
}

// Lines without routing and LSS pay for these conditions only: nothing is stored for later.
[[gnu::hot]] void NodeLine::do_receive(std::span<const can::Frame> frames) {
  own_objects_.pass_time(frames.empty() ? advanced_to_ : frames.back().time);
  if (sleeps()) [[unlikely]] {
    receive_asleep(frames);
  } else if (services_.lss.listens() || services_.routing.takes_part()) [[unlikely]] {
    receive_beside_others(frames);
  } else {
    node_.receive(frames);
  }
  if (services_.receivers.unlike().any()) [[unlikely]] {
    invalidate_unlike_nodes();
  }
}

void NodeLine::invalidate_unlike_nodes() {
  for (const NodeConfig& device : config_.nodes) {
    if (services_.receivers.unlike()[device.id]) {
      image_.set_node_valid(device.id, false);
      services_.srdos.forget(device.id);
    }
  }
}

// Each frame may end a phase, or wake the line, before it is processed.
void NodeLine::receive_asleep(std::span<const can::Frame> frames) {
  dirty_ = true;
  for (const can::Frame& frame : frames) {
    services_.sleep.hear(frame.time);
    receive_beside_others(std::span(&frame, 1));
  }
}

// PDOs do not affect routing.
void NodeLine::receive_beside_others(std::span<const can::Frame> frames) {
  if (services_.lss.listens()) {
    dirty_ = true;
    services_.lss.hear(frames);
  }
  const std::uint64_t served = node_.served();
  node_.receive(frames);
  if (services_.routing.takes_part() && node_.served() != served) {
    dirty_ = true;
    services_.routing.hand_on(frames.back().time);
  }
}
bool NodeLine::wants_to_send(Instant now) const {
  return services_.sleep.may_transmit() && (!is_cut_off(now) || services_.flying.may_probe(now)) &&
         (node_.wants_to_send(now) || services_.lss.wants_to_send());
}
const image::Layout& NodeLine::layout(image::Direction direction) const {
  return image_.layout(direction);
}
void NodeLine::snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                        bool merge) {
  image_.snapshot(direction, into, now, merge, syncs_);
}
[[gnu::hot]] bool NodeLine::image_changed(image::Direction direction) const {
  return image_.changed(direction);
}
[[gnu::hot]] bool NodeLine::image_touched(image::Direction direction) const {
  return image_.touched(direction);
}
bool NodeLine::do_request_pdo(std::uint16_t rpdo) {
  return usable() && !services_.flying.is_passive() && node_.pdos().request_rpdo(rpdo);
}
void NodeLine::set_utc(Duration offset) {
  node_.clock().set_utc(offset);
}
std::optional<Duration> NodeLine::network_utc(Instant now) const {
  return node_.clock().network_utc(now);
}
void NodeLine::do_set_medium(storage::Medium* medium, ParameterSet of) {
  if (of.device == 0 && of.kind == ParameterSet::Kind::objects) {
    node_.set_medium(medium);
  }
}
void NodeLine::do_medium_done(bool good, ParameterSet of) {
  if (of.device == 0 && of.kind == ParameterSet::Kind::objects) {
    node_.medium_done(good);
  }
}

[[gnu::hot]] Line::Input NodeLine::input(std::uint32_t entry, std::uint8_t part) const {
  using image::Direction;
  if ((entry & kForwarded) != 0) {
    return forwarded_input(entry & ~kForwarded);
  }
  const std::uint16_t rpdo = image_.layout(Direction::inputs).entries[entry].local_pdo;
  return {.value = part == 0 ? image_.read_entry(Direction::inputs, entry)
                             : image_.read_part(Direction::inputs, entry, part),
          .valid = image_.is_valid(Direction::inputs, entry),
          .late = rpdo != 0 && node_.pdos().timed_out(rpdo),
          .received = rpdo == 0 ? Instant{} : image_.area(Direction::inputs).pdo(rpdo - 1U).last,
          .pdo = rpdo};
}

// Of the RPDOs that map the object, the one received last counts.
Line::Input NodeLine::forwarded_input(std::size_t object) const {
  forwarded_.follow(node_.dictionary(), node_.pdos().revision());
  Input out;
  out.value = node_.dictionary().number(config_.forwarding.objects[object].address).value_or(0);
  const image::Area& inputs = image_.area(image::Direction::inputs);
  for (const std::uint16_t number : forwarded_.rpdos(object)) {
    const Instant last = inputs.pdo(number - 1U).last;
    if (last > out.received && last >= woke_at_ && !sleeps()) {
      out.valid = true;
      out.late = node_.pdos().timed_out(number);
      out.received = last;
      out.pdo = number;
    }
  }
  return out;
}

[[gnu::hot]] void NodeLine::note_acknowledged(std::uint64_t number, Instant now) {
  node_.pdos().acknowledged(number);
  services_.receivers.acknowledged(number);
  if (services_.sleep.awaits_acknowledge()) [[unlikely]] {
    dirty_ = true;
    services_.sleep.acknowledged(number, now);
  }
  if (services_.lss.awaits_acknowledgement()) [[unlikely]] {
    dirty_ = true;
    services_.lss.acknowledged(number, now);
  }
  if (services_.flying.is_held()) [[unlikely]] {
    dirty_ = true;
  }
}

void NodeLine::note_lost(std::uint64_t first, std::uint64_t last) {
  node_.pdos().lost(first, last);
  services_.lss.lost(first, last);
  services_.sleep.lost(first, last);
  services_.receivers.lost(first, last);
}

bool NodeLine::carries_newest(const FramesUnderWay::Awaited& awaited,
                              const can::Frame& frame) const {
  return node_.pdos().carries_newest(awaited.tpdo, frame, awaited.samples);
}

void NodeLine::do_execute(Command command, Instant now) {
  if (sleeps() && !services_.sleep.permits(kind(command))) {
    refuse(command, Refusal::wrong_state, now);
    return;
  }
  if (services_.flying.is_passive()) [[unlikely]] {
    change_role(now);  // it may have been lost by a frame of the same round
  }
  const std::uint32_t client = command.client;
  if (client != 0 && services_.sleep.may_transmit()) {
    carry_out_orders(now, 0);  // of others, by a write over the bus
  }
  service_of_[command.request.index()]->execute(std::move(command), now);
  if (client != 0 && services_.sleep.may_transmit()) {
    carry_out_orders(now, client);
  }
}

// What a command has ordered by a write to the own dictionary: the frames are those of its client.
void NodeLine::carry_out_orders(Instant now, std::uint32_t client) {
  change_role(now);  // 1F80h may have been written before
  startup_.advance(now, client);
  services_.records.carry_out_orders(now, client);
  services_.configure.carry_out_requests(now, client);
}

void NodeLine::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  service_of_[sending.command.request.index()]->answer_unsent(sending, now);
}

}  // namespace linegate::line
