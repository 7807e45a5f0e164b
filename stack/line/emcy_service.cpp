// SPDX-License-Identifier: Apache-2.0
#include "stack/line/emcy_service.h"

#include <array>
#include <utility>

#include "stack/line/command_checks.h"

namespace linegate::line {

std::span<const CommandKind> EmcyService::commands() const {
  static constexpr std::array kCommands{CommandKind::emcy_send};
  return kCommands;
}

void EmcyService::execute(Command command, Instant now) {
  const auto& request = std::get<EmcySend>(command.request);
  Error why = check_emcy(node_.state());
  if (why == Error{}) {
    why = to_error(
        node_.report_error(request.code, request.error_register, request.manufacturer, now));
  }
  if (why != Error{}) {
    host().answer(command, why, {}, now);
    return;
  }
  host().answer_when_sent(
      {.command = std::move(command), .frames = {{.frame = node_.emcy().newest()}}}, now);
}

// A queued EMCY is sent nevertheless.
void EmcyService::end(Refusal /*why*/, Instant /*now*/) {
}

void EmcyService::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const FramesUnderWay::Awaited& awaited = sending.frames.front();
  const bool waits = awaited.number == 0 && !host().bus_is_stuck(now) && !host().sleeps() &&
                     node_.emcy().waits(awaited.frame);
  host().refuse(sending.command, waits ? Refusal::awaits_turn : Refusal::no_acknowledge, now);
}

void EmcyService::before_boot(Instant now) {
  host().refuse_unsent(CommandKind::emcy_send, Refusal::wrong_state, now);
}

}  // namespace linegate::line
