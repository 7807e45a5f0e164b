// SPDX-License-Identifier: Apache-2.0
#include "stack/line/line_base.h"

#include <utility>

#include "stack/can/cob_id.h"

namespace linegate::line {

namespace {

// Messages that may wait until somebody takes them: more than a batch of frames can give.
constexpr std::size_t kMessages = 4096;
constexpr std::size_t kFewMessages = 64;  // of a line that only refuses

}  // namespace

Line::Base::Base(LineConfig line_config)
    : config(std::move(line_config)),
      load(config.bit_rate),
      messages(config.routing.interface != 0 ? kMessages : kFewMessages) {
  events.limit_repeats();
}

void Line::Base::stir(Instant /*now*/) {
}
bool Line::Base::next_frame(can::Frame& /*out*/, Instant /*now*/) {
  return false;
}
bool Line::Base::wants_to_send(Instant /*now*/) const {
  return false;
}
void Line::Base::write_bound(std::span<const BoundValue> /*values*/, Instant /*now*/) {
}
bool Line::Base::request_pdo(std::uint16_t /*rpdo*/) {
  return false;
}
std::uint64_t Line::Base::layout_revision() const {
  return 0;
}
void Line::Base::set_utc(Duration /*offset*/) {
}
void Line::Base::set_medium(storage::Medium* /*medium*/, std::uint8_t /*device*/) {
}
void Line::Base::medium_done(bool /*good*/, std::uint8_t /*device*/) {
}
node::Indicators Line::Base::indicators() const {
  return {};
}
std::optional<OwnDevice> Line::Base::own_device(std::uint8_t /*id*/) const {
  return std::nullopt;
}

// Of a role or configuration that takes no part in routing: nobody is left waiting.
void Line::Base::deliver(const routing::Message& message, Instant /*now*/) {
  ++routed.unexpected;
  if (const auto answer = routing::undeliverable(message)) {
    (void)messages.push(*answer);
  }
}

void Line::Base::set_routes(const routing::Config& /*wanted*/) {
}

void Line::Base::routes(std::vector<routing::Route>& out) const {
  out.clear();
}

void Line::Base::emit(EventKind kind, Instant time, std::uint32_t code, std::uint32_t value) {
  events.emit({.time = time, .kind = kind, .code = code, .value = value});
}

bool Line::Base::note(const can::BusEvent& event) {
  Event out{.time = event.time};
  switch (event.kind) {
    case can::BusEvent::Kind::state:
      transmit_errors = event.transmit_errors;
      receive_errors = event.receive_errors;
      if (event.state == bus) {
        return false;
      }
      out.kind = EventKind::bus_state;
      out.code = static_cast<std::uint32_t>(event.state);
      out.value = static_cast<std::uint32_t>(failed_from.value_or(bus));
      bus = event.state;
      failed_from.reset();
      out.length = 2;
      out.data[0] = std::byte{transmit_errors};
      out.data[1] = std::byte{receive_errors};
      break;
    case can::BusEvent::Kind::error:
      ++counters.bus_errors;
      out.kind = EventKind::bus_error;
      out.code = event.errors;
      break;
    case can::BusEvent::Kind::frames_lost:
      counters.frames_lost += event.count;
      out.kind = EventKind::frames_lost;
      out.value = event.count;
      break;
    case can::BusEvent::Kind::interface_failed:
      failed_from = failed_from.value_or(bus);
      bus = can::BusState::absent;
      out.kind = EventKind::interface_failed;
      out.code = event.code;
      break;
    case can::BusEvent::Kind::interface_ready:
      bus = can::BusState::error_active;
      failed_from.reset();
      out.kind = EventKind::interface_ready;
      break;
  }
  events.emit(out);
  return true;
}

bool Line::Base::usable() const {
  return bus != can::BusState::absent && bus != can::BusState::stopped &&
         bus != can::BusState::bus_off;
}

void Line::Base::receive_counted(std::span<const can::Frame> frames) {
  load.count_fast(frames);
  receive(frames);
}

bool Line::Base::next_counted(can::Frame& out, Instant now) {
  if (!next_frame(out, now)) {
    return false;
  }
  load.count_fast(std::span(&out, 1));
  return true;
}

void Line::Base::reply(std::uint64_t tag, Error error, std::vector<std::byte> data) {
  replies.push_back({.tag = tag, .error = error, .data = std::move(data)});
}

void Line::Base::refuse(const Command& command, Refusal refusal, Instant now) {
  ++counters.commands_refused;
  Event event{.time = now, .kind = EventKind::command_refused};
  event.node = command.node <= can::kMaxNodeId ? command.node : std::uint8_t{0};
  event.code = static_cast<std::uint32_t>(refusal);
  event.value = static_cast<std::uint32_t>(command.kind);
  events.emit(event);
  reply(command.tag, to_error(refusal));
}

void Line::Base::answer(const Command& command, Error error, std::vector<std::byte> data,
                        Instant now) {
  if (error.domain == Domain::command) {
    refuse(command, static_cast<Refusal>(error.code), now);
  } else {
    reply(command.tag, error, std::move(data));
  }
}

OutputRefusal Line::Base::refuse(const OutputWrite& write, OutputRefusal refusal, Instant now) {
  ++counters.output_writes_refused;
  emit(EventKind::output_refused, now, static_cast<std::uint32_t>(refusal), write.group);
  return refusal;
}

}  // namespace linegate::line
