// SPDX-License-Identifier: Apache-2.0
// What a command of an unconfirmed service is answered when its frame was not acknowledged in time.
#include <algorithm>

#include "stack/line/line_impl.h"

namespace linegate::line {

void Line::Impl::note_acknowledged(std::uint64_t number, Instant now) {
  node.pdos().acknowledged(number);
  if (has_end.any()) [[unlikely]] {
    note_acknowledged_ends(number);
  }
  if (manager.starts_any()) [[unlikely]] {
    note_acknowledged_starts(number);
  }
  if (lss.awaits_acknowledgement()) [[unlikely]] {
    stirred = true;
    lss.acknowledged(number, now);
  }
  if (!scanned_outputs.empty()) [[unlikely]] {
    scanned_acknowledged(number);
  }
}

void Line::Impl::note_lost(std::uint64_t first, std::uint64_t last) {
  node.pdos().lost(first, last);
  lss.lost(first, last);
  scanned_lost(first, last);
  note_lost_ends(first, last);
  note_lost_starts(first, last);
}

bool Line::Impl::carries_newest(const FramesUnderWay::Awaited& awaited,
                                const can::Frame& frame) const {
  return node.pdos().carries_newest(awaited.tpdo, frame, awaited.samples);
}

void Line::Impl::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const CommandKind kind = sending.command.kind;
  if (kind == CommandKind::output_write || kind == CommandKind::object_write) {
    answer_unsent_value(sending, now);
  } else {
    refuse(sending.command, reason_of(sending, now), now);
  }
}

// What its PDO waits for at present.
void Line::Impl::answer_unsent_value(FramesUnderWay::Sending& sending, Instant now) {
  const FramesUnderWay::Awaited& awaited = sending.frames.front();
  if (awaited.tpdo == 0) {  // by MPDO
    const bool operational = node.state() == nmt::State::operational;
    const bool stuck = awaited.number != 0 || bus_is_stuck(now);
    const PdoWait why = !operational ? PdoWait::operational : stuck ? PdoWait::bus : PdoWait::turn;
    reply(sending.command.tag, Error{}, way_of(scanner_tpdo(), why));
    return;
  }
  const std::uint8_t receiving = image.node_of(image::Direction::outputs, awaited.tpdo);
  if (!takes_single_writes(receiving)) {
    sending.command.node = receiving;
    refuse(sending.command, Refusal::wrong_state, now);
    return;
  }
  PdoWait wait = wait_of(awaited.tpdo);
  if (wait == PdoWait::none) {
    wait = awaited.number != 0 || bus_is_stuck(now) ? PdoWait::bus : PdoWait::turn;
  }
  reply(sending.command.tag, Error{}, way_of(awaited.tpdo, wait));
}

Refusal Line::Impl::reason_of(const FramesUnderWay::Sending& sending, Instant now) const {
  const bool waits = std::ranges::any_of(
      sending.frames, [](const FramesUnderWay::Awaited& awaited) { return awaited.number == 0; });
  if (!waits || bus_is_stuck(now)) {
    return Refusal::no_acknowledge;
  }
  const Command& command = sending.command;
  const bool of_pdo =
      command.kind == CommandKind::pdo_trigger || command.kind == CommandKind::mpdo_write;
  if (of_pdo && node.state() != nmt::State::operational) {
    return Refusal::wrong_state;
  }
  const bool of_nmt = command.kind == CommandKind::nmt && nmt.waits({command.nmt, command.node});
  const bool of_emcy =
      command.kind == CommandKind::emcy_send && node.emcy().waits(sending.frames.front().frame);
  return of_pdo || of_nmt || of_emcy ? Refusal::awaits_turn : Refusal::no_acknowledge;
}

}  // namespace linegate::line
