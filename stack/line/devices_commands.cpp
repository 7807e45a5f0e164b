// SPDX-License-Identifier: Apache-2.0
// Output values and commands of a line in the role device.
#include <algorithm>
#include <array>

#include "stack/line/command_checks.h"
#include "stack/line/devices_line.h"
#include "stack/line/mpdo_service.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

using image::Direction;

// IXXAT CANopen Manager API manual 5.17, as in output_service.cpp.
constexpr std::uint16_t kSilentWriterEmcy = 0x6200;
constexpr std::uint8_t kSilentWriterRegister = 0x81;

}  // namespace

VirtualDevice* DevicesLine::named(std::uint8_t id) const {
  return id == 0 && seats.size() == 1 ? seats.front().device.get() : find(id);
}

// Requests for a device of the line itself are executed directly, without the bus. The line is not
// the master of other nodes.
struct DevicesLine::Execution {
  void operator()(const SdoRead& request) const {
    ReplyData data;
    const Error error =
        line.find(request.node) == nullptr
            ? to_error(Refusal::wrong_role)
            : line.read_device({.node = request.node, .what = request.address}, data);
    line.answer(command, error, std::move(data), now);
  }
  void operator()(const SdoWrite& request) const {
    const LocalWrite write{.node = request.node, .address = request.address, .data = request.data};
    answer(line.find(request.node) == nullptr ? to_error(Refusal::wrong_role)
                                              : line.write_device(write, now));
  }
  void operator()(const LocalRead& request) const {
    ReplyData data;
    const Error error = line.read_device(request, data);
    line.answer(command, error, std::move(data), now);
  }
  void operator()(const LocalWrite& request) const { answer(line.write_device(request, now)); }
  void operator()(const SingleOutput& /*request*/) const { line.single_output(command, now); }
  void operator()(const EmcySend& /*request*/) const { line.send_emcy(command, now); }
  void operator()(const NmtRequest& request) const { answer(line.send_nmt(request, now)); }
  void operator()(const PdoTrigger& /*request*/) const { line.trigger_pdo(command, now); }
  void operator()(const CanSend& /*request*/) const { line.send_frame(command, now); }
  void operator()(const CanListen& request) const { answer(line.listening.ask(request, now)); }
  // Other services belong to a manager, or to a line with a single own node.
  template <class Other>
  void operator()(const Other& /*request*/) const {
    line.refuse(command, Refusal::wrong_role, now);
  }

  void answer(Error error) const { line.answer(command, error, {}, now); }

  DevicesLine& line;
  const Command& command;
  Instant now;
};

void DevicesLine::do_execute(Command command, Instant now) {
  follow_resets(now);
  std::visit(Execution{*this, command, now}, command.request);
}

Error DevicesLine::read_device(const LocalRead& request, ReplyData& data) const {
  VirtualDevice* const device = named(request.node);
  return device == nullptr ? to_error(Refusal::bad_request)
                           : read_object(device->node().dictionary(), request.what, data);
}

Error DevicesLine::write_device(const LocalWrite& request, Instant now) {
  VirtualDevice* const device = named(request.node);
  if (device == nullptr) {
    return to_error(Refusal::bad_request);
  }
  const AbortCode code = device->write(request.address, request.data, request.as_owner, now);
  return code == AbortCode::none ? Error{} : to_error(code);
}

// The device has the value immediately, its master when the frame of the TPDO was sent.
void DevicesLine::single_output(const Command& command, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  const auto& request = std::get<SingleOutput>(command.request);
  if (const Error why = check_single_output(request, layout, outputs); why != Error{}) {
    const ReplyData group = fired_group_of(request.entry, outputs);
    refuse(command, static_cast<Refusal>(why.code), now, 0, group);
    return;
  }
  image.write_entry(Direction::outputs, request.entry, request.data);
  collect(request.entry);
  hand_out(true, now);
  const image::Entry& entry = layout.entries[request.entry];
  VirtualDevice& device = *find(entry.node);
  std::vector<FramesUnderWay::Awaited> frames = device.frames_of(request.entry);
  if (frames.empty() && device.has_node_id()) {
    reply(command.tag, Error{});
    return;
  }
  const std::uint16_t by = frames.empty() ? entry.remote_pdo : frames.front().sender();
  if (device.state().state != nmt::State::operational) {
    reply(command.tag, Error{}, WrittenByPdo{by, PdoWait::operational});
    return;
  }
  answer_when_sent({.command = command,
                    .frames = std::move(frames),
                    .data = WrittenByPdo{by, PdoWait::none},
                    .any_frame = true},
                   now);
}

void DevicesLine::send_emcy(const Command& command, Instant now) {
  const auto& request = std::get<EmcySend>(command.request);
  VirtualDevice* device = named(request.node);
  Error why = to_error(Refusal::bad_request);
  if (device != nullptr) {
    why = check_emcy(device->state().state);
  }
  if (why == Error{}) {
    why = to_error(
        device->send_emcy(request.code, request.error_register, request.manufacturer, now));
  }
  if (why != Error{}) {
    answer(command, why, {}, now);
    return;
  }
  answer_when_sent({.command = command,
                    .frames = {{.frame = device->node().emcy().newest(), .device = device->id()}}},
                   now);
}

// Only for devices of the line: it is not the master of other nodes.
Error DevicesLine::send_nmt(const NmtRequest& request, Instant now) {
  if (const Error why = check_nmt(request.command, request.node); why != Error{}) {
    return why;
  }
  if (request.node != 0 && find(request.node) == nullptr) {
    return to_error(Refusal::wrong_role);
  }
  for (const Seat& seat : seats) {
    if (request.node == 0 || seat.device->id() == request.node) {
      seat.device->command(request.command, now);
    }
  }
  return {};
}

// Triggers a TPDO of the device.
void DevicesLine::trigger_pdo(const Command& command, Instant now) {
  const auto& request = std::get<PdoTrigger>(command.request);
  VirtualDevice* device = named(request.node);
  Refusal why = Refusal::none;
  if (device == nullptr || request.number == 0) {
    why = Refusal::bad_request;
  } else if (device->state().state != nmt::State::operational) {
    why = Refusal::wrong_state;
  } else if (!device->node().pdos().trigger(request.number, now)) {
    why = Refusal::unknown_entry;
  }
  if (why != Refusal::none) {
    refuse(command, why, now);
    return;
  }
  answer_when_sent({.command = command,
                    .frames = {{.tpdo = request.number, .device = device->id()}},
                    .data = TriggeredPdos{request.number}},
                   now);
}

Error DevicesLine::check_generic(const can::Frame& frame) const {
  if (const Error why = check_frame(frame); why != Error{}) {
    return why;
  }
  for (const Seat& seat : seats) {
    if (uses_identifier(seat.device->node(), {}, frame)) {
      return to_error(Refusal::identifier_in_use);
    }
  }
  return usable() ? Error{} : to_error(Refusal::line_down);
}

// The first device sends it; the other devices receive it like any frame of the bus.
void DevicesLine::send_frame(const Command& command, Instant now) {
  const can::Frame& frame = std::get<CanSend>(command.request).frame;
  VirtualDevice& sender = *seats.front().device;
  Error why = check_generic(frame);
  if (why == Error{}) {
    why = send_generic(sender.node(), frame);
  }
  if (why != Error{}) {
    answer(command, why, {}, now);
    return;
  }
  answer_when_sent({.command = command, .frames = {{.frame = frame, .device = sender.id()}}}, now);
}

OutputRefusal DevicesLine::do_write_outputs(const OutputWrite& write, Instant now) {
  if (const OutputRefusal refusal = outputs.check(write); refusal != OutputRefusal::none) {
    outputs.note_refused({.refusal = refusal, .group = write.group, .client = write.client_number},
                         write.client, now);
    return refusal;
  }
  if (const auto before = outputs.displaces(write)) {
    emit(now, event::OutputOwner{
                  .group = write.group, .client = write.client_number, .before = *before});
  }
  if (outputs.accept(write, now)) {
    emit(now, event::OutputArmed{
                  .group = write.group,
                  .watchdog = std::chrono::duration_cast<std::chrono::milliseconds>(write.watchdog),
                  .client = write.client_number});
    if (!outputs.any_silent()) {
      for (const Seat& seat : seats) {
        seat.device->node().end_reported(kSilentWriterEmcy, now);
      }
    }
  }
  for (const OutputValue& value : write.values) {
    image.write_entry(Direction::outputs, value.entry, std::span(value.data).first(value.length));
    collect(value.entry);
  }
  for (const OutputBytes& run : write.bytes) {
    image.write_bytes(Direction::outputs, run.offset, run.data);
    collect(run);
  }
  hand_out(outputs.group(write.group)->config.send_always, now);
  return OutputRefusal::none;
}

bool DevicesLine::do_feed_watchdog(const OutputWrite& write, Instant now) {
  return outputs.feed(write, now);
}

[[gnu::hot]] void DevicesLine::write_bound_entry(const BoundValue& value) {
  if (image.layout(Direction::outputs).entries[value.entry].bit_length <= 64) [[likely]] {
    image.write_entry(Direction::outputs, value.entry, value.value);
  } else {
    image.write_part(Direction::outputs, value.entry, value.part, value.value);
  }
}

void DevicesLine::write_bound(std::span<const BoundValue> values, Instant now) {
  bool always = false;
  for (const BoundValue& value : values) {
    routed_.values += value.always && value.part == 0 ? 1U : 0U;
    if (value.valid) {
      write_bound_entry(value);
      collect(value.entry);
      always = always || value.always;
    } else {
      image.forget_entry(Direction::outputs, value.entry);
    }
  }
  hand_out(always, now);
}

void DevicesLine::output_state(std::size_t position, OutputState& out) const {
  outputs.describe(position, out);
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  const bool stuck = bus_is_stuck(advanced_to);
  add_waits(
      outputs.groups()[position], image,
      [&](std::uint32_t entry) { return find(entries[entry].node)->reason_of(entry, stuck); }, out);
}

// The entries of the layout are ordered by their position in the image.
void DevicesLine::collect(const OutputBytes& run) {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  const std::uint64_t begin = std::uint64_t{run.offset} * 8U;
  const std::uint64_t end = begin + run.data.size() * 8U;
  auto it = std::ranges::lower_bound(entries, begin, {}, &image::Entry::bit_offset);
  for (; it != entries.end() && it->bit_offset < end; ++it) {
    collect(static_cast<std::uint32_t>(it - entries.begin()));
  }
}

// Sorted by entry, the entries of one device are adjacent.
void DevicesLine::hand_out(bool always, Instant now) {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  std::ranges::sort(written);
  for (std::size_t first = 0; first < written.size();) {
    const std::uint8_t id = entries[written[first]].node;
    std::size_t last = first;
    while (last < written.size() && entries[written[last]].node == id) {
      ++last;
    }
    find(id)->apply_outputs(std::span(written).subspan(first, last - first), always, now);
    first = last;
  }
  written.clear();
}

void DevicesLine::apply_defaults(Instant now) {
  for (const OutputDefault& value : config_.defaults) {
    image.write_entry(Direction::outputs, value.entry, value.value);
    collect(value.entry);
  }
  hand_out(false, now);
}

// Reactions that do not apply to the role are ignored; the event has those that were executed.
void DevicesLine::react(const Outputs::Group& group, Instant now) {
  std::uint8_t taken = kHoldOutputs;
  if ((group.reactions & kZeroOutputs) != 0) {
    for (const std::uint32_t entry : group.config.entries) {
      if (image.is_known(Direction::outputs, entry)) {
        image.write_entry(Direction::outputs, entry, std::uint64_t{0});
        collect(entry);
      }
    }
    hand_out(true, now);
    taken |= kZeroOutputs;
  }
  for (const Seat& seat : seats) {
    if (!seat.device->has_node_id()) {
      continue;
    }
    if ((group.reactions & kSendEmcy) != 0) {
      const emcy::SendResult result =
          seat.device->send_emcy(kSilentWriterEmcy, kSilentWriterRegister, {}, now);
      if (result == emcy::SendResult::sent || result == emcy::SendResult::queued) {
        taken |= kSendEmcy;
      }
    }
    if ((group.reactions & kHeartbeatOff) != 0) {
      seat.device->node().dictionary().set({od::objects::kProducerHeartbeatTime, 0},
                                           std::uint16_t{0});
      taken |= kHeartbeatOff;
    }
  }
  emit(now, event::OutputWatchdog{.group = group.config.number, .reactions = taken});
}

}  // namespace linegate::line
