// SPDX-License-Identifier: Apache-2.0
// Replies to commands of unconfirmed services of the line's devices whose frame was not
// acknowledged in time.
#include <algorithm>
#include <utility>

#include "stack/line/devices_line.h"

namespace linegate::line {

bool DevicesLine::carries_newest(const FramesUnderWay::Awaited& awaited,
                                 const can::Frame& frame) const {
  VirtualDevice* device = find(awaited.device);
  return device != nullptr &&
         device->node().pdos().carries_newest(awaited.tpdo, frame, awaited.samples);
}

void DevicesLine::note_acknowledged(std::uint64_t number, Instant /*now*/) {
  for (const Seat& seat : seats) {
    seat.device->acknowledged(number);
  }
}

void DevicesLine::note_lost(std::uint64_t first, std::uint64_t last) {
  for (const Seat& seat : seats) {
    seat.device->lost(first, last);
  }
}

void DevicesLine::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const Refusal why = reason_of(sending, now);
  if (kind(sending.command) != CommandKind::output_write) {
    refuse(sending.command, why, now);
    return;
  }
  const PdoWait wait = why == Refusal::wrong_state   ? PdoWait::operational
                       : why == Refusal::awaits_turn ? PdoWait::turn
                                                     : PdoWait::bus;
  const auto& way = std::get<WrittenByPdo>(sending.data);
  reply(sending.command.tag, Error{}, WrittenByPdo{way.pdo, wait});
}

// Such a command waits for one frame, or any of several of one device.
Refusal DevicesLine::reason_of(const FramesUnderWay::Sending& sending, Instant now) const {
  const FramesUnderWay::Awaited& awaited = sending.frames.front();
  VirtualDevice* device = find(awaited.device);
  const bool of_pdo = awaited.sender() != 0;
  const bool waits = !sending.is_handed_out();
  if (device == nullptr || (of_pdo && waits && device->node().state() != nmt::State::operational)) {
    return Refusal::wrong_state;
  }
  if (!waits || bus_is_stuck(now)) {
    return Refusal::no_acknowledge;
  }
  return of_pdo || device->node().emcy().waits(awaited.frame) ? Refusal::awaits_turn
                                                              : Refusal::no_acknowledge;
}

void DevicesLine::follow_resets(Instant now) {
  for (Seat& seat : seats) {
    const std::uint64_t resets = seat.device->node().counters().resets;
    if (std::exchange(seat.resets, resets) == resets) {
      continue;
    }
    for (const CommandKind kind : {CommandKind::emcy_send, CommandKind::pdo_trigger}) {
      refuse_unsent(kind, Refusal::wrong_state, now, seat.device->id());
    }
  }
}

}  // namespace linegate::line
