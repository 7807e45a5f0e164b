// SPDX-License-Identifier: Apache-2.0
#include "stack/line/line.h"

#include <utility>
#include <variant>

#include "stack/image/limits.h"
#include "stack/line/build.h"
#include "stack/line/devices_line.h"
#include "stack/line/node_line.h"
#include "stack/line/observer_line.h"
#include "stack/line/srdo_plan.h"

namespace linegate::line {
namespace {

// Messages that may wait to be taken: more than one batch of frames can cause.
constexpr std::size_t kMessages = 4096;
constexpr std::size_t kFewMessages = 64;  // of a line that only rejects

Event accepted_event(const Command& command, Instant now) {
  event::CommandAccepted accepted{.command = kind(command), .client = command.client};
  std::visit(
      [&accepted](const auto& request) {
        if constexpr (requires { request.address; }) {
          accepted.index = request.address.index;
          accepted.sub = request.address.sub;
        }
      },
      command.request);
  const std::uint8_t node = node_of(command);
  return {.time = now, .node = node <= can::kMaxNodeId ? node : std::uint8_t{0}, .data = accepted};
}

}  // namespace

Loaded<std::unique_ptr<Line>> Line::make(LineConfig config) {
  Loaded<std::unique_ptr<Line>> out;
  out.diagnostics = check(config);
  if (has_errors(out.diagnostics)) {
    return out;
  }
  const std::vector<Diagnostic> left_out = leave_out_srdos(config);
  out.diagnostics.insert(out.diagnostics.end(), left_out.begin(), left_out.end());
  const bool has_devices = !config.devices.empty();
  Loaded<pdo::LinkPlan> plan = has_devices ? device_plan(config) : link_plan(config);
  out.diagnostics.insert(out.diagnostics.end(), plan.diagnostics.begin(), plan.diagnostics.end());
  if (!plan.ok()) {
    return out;
  }
  if (has_devices || config.role == Role::observer) {
    config.own_objects.clear();  // these roles have no such dictionary
  } else if (!place_own_objects(config, *plan.value)) {
    out.diagnostics.push_back({Severity::error, config.name, 0, 0,
                               "own objects in the image: an area would have more than " +
                                   std::to_string(image::kMaxAreaBytes) + " bytes or " +
                                   std::to_string(image::kMaxEntries) + " entries"});
    return out;
  }
  const std::vector<Diagnostic> wrong = check_outputs(config, plan.value->outputs);
  out.diagnostics.insert(out.diagnostics.end(), wrong.begin(), wrong.end());
  if (has_errors(out.diagnostics)) {
    return out;
  }
  describe_outputs(config, plan.value->outputs);
  if (has_devices || config.role == Role::observer) {
    config.forwarding = {};  // these roles have no dictionary for it
  } else {
    const auto faults = routing::check(config.forwarding, *plan.value, config.name);
    out.diagnostics.insert(out.diagnostics.end(), faults.begin(), faults.end());
    if (has_errors(faults)) {
      return out;
    }
    routing::show_in_records(config.forwarding, *plan.value);
  }
  if (has_devices) {
    out.value = std::make_unique<DevicesLine>(std::move(config), *std::move(plan.value));
  } else if (config.role == Role::observer) {
    out.value = std::make_unique<ObserverLine>(std::move(config), *std::move(plan.value));
  } else {
    out.value = std::make_unique<NodeLine>(std::move(config), *std::move(plan.value));
  }
  return out;
}

Line::Line(LineConfig config)
    : config_(std::move(config)),
      load_(config_.bit_rate),
      messages_(config_.routing.interface != 0 ? kMessages : kFewMessages) {
  events_.limit_repeats();
  if (config_.canopen_fd) {
    load_.expect_fd();
    load_.set_bit_rates(config_.bit_rate, config_.data_bit_rate);
  }
}

void Line::start(Instant now) {
  mark_dirty(now);
  running_ = true;
  emit(now, event::LineStarted{config_.role});
  do_start(now);
}

void Line::stop(Instant now) {
  mark_dirty(now);
  if (std::exchange(running_, false)) {
    do_stop(now);
    emit(now, event::LineStopped{});
  }
}

void Line::set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate) {
  load_.set_bit_rates(config_.bit_rate != 0 ? config_.bit_rate : bit_rate,
                      config_.data_bit_rate != 0 ? config_.data_bit_rate : data_bit_rate);
}

void Line::bus_event(const can::BusEvent& event) {
  mark_dirty();
  if (note(event)) {
    do_bus_event(event);
  }
}

void Line::report(const Event& event) {
  events_.emit(event);
  if (const auto* const refused = event.get<event::OutputRefused>()) {
    note_refused(*refused, event.time);
  }
}

void Line::set_medium(storage::Medium* medium, ParameterSet of) {
  mark_dirty();
  do_set_medium(medium, of);
}

void Line::medium_done(bool good, ParameterSet of) {
  mark_dirty();
  do_medium_done(good, of);
}

void Line::execute(Command command, Instant now) {
  mark_dirty(now);
  ++counters_.commands;
  if (!command.audited) {
    do_execute(std::move(command), now);
    return;
  }
  const Event accepted = accepted_event(command, now);
  const std::uint64_t refused = counters_.commands_refused;
  do_execute(std::move(command), now);
  if (counters_.commands_refused == refused) {
    report(accepted);
  }
}

OutputRefusal Line::write_outputs(const OutputWrite& write, Instant now) {
  mark_dirty(now);
  const OutputRefusal refusal = do_write_outputs(write, now);
  if (refusal == OutputRefusal::none) {
    ++counters_.output_writes;
  } else {
    ++counters_.output_writes_refused;
    if (write.forwarded && refusal == OutputRefusal::wrong_role) {
      return refusal;  // another flying master is active: values of gateways come all the time
    }
    events_.emit({.time = now,
                  .node = refusal == OutputRefusal::wrong_role ? active_master() : std::uint8_t{0},
                  .data = event::OutputRefused{
                      .refusal = refusal, .group = write.group, .client = write.client_number}});
  }
  return refusal;
}

bool Line::request_pdo(std::uint16_t rpdo) {
  mark_dirty();
  return do_request_pdo(rpdo);
}

void Line::deliver(const routing::Message& message, Instant now) {
  mark_dirty(now);
  do_deliver(message, now);
}

void Line::reject(const routing::Message& message) {
  ++routed_.unexpected;
  if (const auto answer = routing::undeliverable(message)) {
    (void)messages_.push(*answer);
  }
}

void Line::set_routes(const routing::Config& wanted, Instant now) {
  mark_dirty(now);
  do_set_routes(wanted);
}

void Line::answer_gateway_request(routing::GatewayAnswer answer, Instant now) {
  mark_dirty(now);
  do_answer_gateway_request(std::move(answer), now);
}

bool Line::pop_reply(Reply& out) {
  if (replies_.empty()) {
    return false;
  }
  out = std::move(replies_.front());
  replies_.pop_front();
  return true;
}

LineState Line::state() const {
  LineState out = do_state();
  out.routing = routed_;
  return out;
}

std::uint64_t Line::node_revision(std::uint8_t node) const {
  return node < 128 ? do_node_revision(node) : 0;
}

NodeState Line::node_state(std::uint8_t node) const {
  return node < 128 ? do_node_state(node) : NodeState{};
}

od::Dictionary& Line::dictionary() {
  mark_dirty();  // the caller may write
  return do_dictionary();
}

bool Line::note(const can::BusEvent& event) {
  EventData out;
  switch (event.kind) {
    case can::BusEvent::Kind::state:
      transmit_errors_ = event.transmit_errors;
      receive_errors_ = event.receive_errors;
      if (event.state == bus_) {
        return false;
      }
      out = event::BusState{.state = event.state,
                            .before = failed_from_.value_or(bus_),
                            .transmit_errors = transmit_errors_,
                            .receive_errors = receive_errors_};
      bus_ = event.state;
      failed_from_.reset();
      break;
    case can::BusEvent::Kind::error:
      ++counters_.bus_errors;
      out = event::BusError{.errors = event.errors};
      break;
    case can::BusEvent::Kind::frames_lost:
      counters_.frames_lost += event.count;
      out = event::FramesLost{event.count};
      break;
    case can::BusEvent::Kind::interface_failed:
      failed_from_ = failed_from_.value_or(bus_);
      bus_ = can::BusState::absent;
      out = event::InterfaceFailed{event.code};
      break;
    case can::BusEvent::Kind::interface_ready:
      bus_ = can::BusState::error_active;
      failed_from_.reset();
      out = event::InterfaceReady{};
      break;
  }
  emit(event.time, out);
  return true;
}

bool Line::usable() const {
  return bus_ != can::BusState::absent && bus_ != can::BusState::stopped &&
         bus_ != can::BusState::bus_off;
}

// A refusal because another flying master is active names it. Only routing_trace has another
// reason: the line does not route.
void Line::reply(std::uint64_t tag, Error error, ReplyData data) {
  if (error == to_error(Refusal::wrong_role) && active_master() != 0) [[unlikely]] {
    data = std::vector{std::byte{active_master()}};
  }
  replies_.push_back({.tag = tag, .error = error, .data = std::move(data)});
}

void Line::refuse(const Command& command, Refusal refusal, Instant now, std::uint8_t named,
                  ReplyData data) {
  ++counters_.commands_refused;
  const std::uint8_t node = named == 0 ? node_of(command) : named;
  events_.emit({.time = now,
                .node = node <= can::kMaxNodeId ? node : std::uint8_t{0},
                .data = event::CommandRefused{
                    .refusal = refusal, .command = kind(command), .client = command.client}});
  if (kind(command) == CommandKind::routing_trace) {
    replies_.push_back({.tag = command.tag, .error = to_error(refusal), .data = {}});
  } else {
    reply(command.tag, to_error(refusal), std::move(data));
  }
}

}  // namespace linegate::line
