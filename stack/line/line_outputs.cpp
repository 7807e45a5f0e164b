// Output values: applied whole, and the watchdog when they stop coming.
#include "stack/line/line_impl.h"

namespace linegate::line {
namespace {

using image::Direction;

// IXXAT CANopen Manager API manual 5.17: 00 62 81 00 00 00 00 00.
constexpr std::uint16_t kWatchdogEmcy = 0x6200;
constexpr std::uint8_t kWatchdogRegister = 0x81;

struct NmtReaction {
  WatchdogReaction bit;
  nmt::Command command;
};
constexpr NmtReaction kNmtReactions[] = {
    {kNmtPreOperational, nmt::Command::enter_pre_operational},
    {kNmtStop, nmt::Command::stop},
    {kNmtResetCommunication, nmt::Command::reset_communication},
    {kNmtResetNode, nmt::Command::reset_node},
};

}  // namespace

OutputRefusal Line::Impl::write_outputs(const OutputWrite& write, Instant now) {
  if (const OutputRefusal refusal = outputs.check(write); refusal != OutputRefusal::none) {
    return refuse(write, refusal, now);
  }
  ++counters.output_writes;
  if (outputs.accept(write, now)) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(write.watchdog).count();
    emit(EventKind::output_armed, now, static_cast<std::uint32_t>(ms), write.group);
  }
  apply(write, outputs.group(write.group)->config.send_always, now);
  return OutputRefusal::none;
}

// All bytes first, then the PDOs: a PDO never carries half of a write.
void Line::Impl::apply(const OutputWrite& write, bool always, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const OutputValue& value : write.values) {
    image.write_entry(Direction::outputs, value.entry, std::span(value.data).first(value.length));
  }
  for (const OutputBytes& run : write.bytes) {
    image.write_bytes(Direction::outputs, run.offset, run.data);
  }
  for (const OutputValue& value : write.values) {
    const image::Entry& entry = layout.entries[value.entry];
    node.pdos().outputs_written(entry.bit_offset, entry.bit_length, always, now);
  }
  for (const OutputBytes& run : write.bytes) {
    node.pdos().outputs_written(run.offset * 8U, static_cast<std::uint32_t>(run.data.size() * 8U),
                                always, now);
  }
}

void Line::Impl::write_bound(std::span<const BoundValue> values, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const BoundValue& value : values) {
    if (value.valid) {
      image.write_entry(Direction::outputs, value.entry, value.value);
    } else {
      image.set_entry_valid(Direction::outputs, value.entry, false);
    }
  }
  for (const BoundValue& value : values) {
    const image::Entry& entry = layout.entries[value.entry];
    node.pdos().outputs_written(entry.bit_offset, entry.bit_length, value.always, now);
  }
}

void Line::Impl::apply_defaults(Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const OutputDefault& value : config.defaults) {
    image.write_entry(Direction::outputs, value.entry, value.value);
  }
  for (const OutputDefault& value : config.defaults) {
    const image::Entry& entry = layout.entries[value.entry];
    node.pdos().outputs_written(entry.bit_offset, entry.bit_length, true, now);
  }
}

// Reactions that do not belong to the role are ignored (IXXAT manual 5.17); the event tells those
// that were taken.
void Line::Impl::react(const Outputs::Group& group, Instant now) {
  std::uint8_t taken = kHoldOutputs;
  if ((group.reactions & kZeroOutputs) != 0) {
    zero(group, now);
    taken |= kZeroOutputs;
  }
  for (const NmtReaction& reaction : kNmtReactions) {
    if ((group.reactions & reaction.bit) != 0 && manages() && nmt.send(reaction.command)) {
      manager.commanded(reaction.command, 0, now);
      taken |= reaction.bit;
    }
  }
  if ((group.reactions & kSendEmcy) != 0) {
    node.emcy().send(kWatchdogEmcy, kWatchdogRegister, {}, now);
    taken |= kSendEmcy;
  }
  if ((group.reactions & kHeartbeatOff) != 0 && config.role == Role::device) {
    node.dictionary().set({0x1017, 0}, std::uint16_t{0});
    taken |= kHeartbeatOff;
  }
  emit(EventKind::output_watchdog, now, taken, group.config.number);
}

// An entry that was never written stays so: its PDO is held back as before.
void Line::Impl::zero(const Outputs::Group& group, Instant now) {
  const image::Layout& layout = image.layout(Direction::outputs);
  for (const std::uint32_t entry : group.config.entries) {
    if (image.is_valid(Direction::outputs, entry)) {
      image.write_entry(Direction::outputs, entry, std::uint64_t{0});
    }
  }
  for (const std::uint32_t entry : group.config.entries) {
    const image::Entry& place = layout.entries[entry];
    node.pdos().outputs_written(place.bit_offset, place.bit_length, true, now);
  }
}

}  // namespace linegate::line
