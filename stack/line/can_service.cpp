// SPDX-License-Identifier: Apache-2.0
#include "stack/line/can_service.h"

#include <array>
#include <utility>

namespace linegate::line {

std::span<const CommandKind> CanService::commands() const {
  static constexpr std::array kCommands{CommandKind::can_send, CommandKind::can_listen};
  return kCommands;
}

void CanService::execute(Command command, Instant now) {
  if (const auto* const listen = std::get_if<CanListen>(&command.request)) {
    host().answer(command, listening_.ask(*listen, now), {}, now);
    return;
  }
  const can::Frame frame = std::get<CanSend>(command.request).frame;
  Error why = check_frame(frame);
  if (why == Error{}) {
    why = send(frame);
  }
  if (why != Error{}) {
    host().answer(command, why, {}, now);
    return;
  }
  host().answer_when_sent({.command = std::move(command), .frames = {{.frame = frame}}}, now);
}

Error CanService::send(const can::Frame& frame) {
  if (uses_identifier(node_, linked_, frame)) {
    return to_error(Refusal::identifier_in_use);
  }
  return host().usable() ? send_generic(node_, frame) : to_error(Refusal::line_down);
}

}  // namespace linegate::line
