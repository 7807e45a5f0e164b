// SPDX-License-Identifier: Apache-2.0
// Program download in the line: the command `program`.
#include "stack/line/line_impl.h"

namespace linegate::line {

void Line::Impl::start_program(Command command, Instant now) {
  Refusal why = Refusal::none;
  if (!manages()) {
    why = Refusal::wrong_role;
  } else if (!usable()) {
    why = Refusal::line_down;
  } else if (command.node == config.node_id) {
    why = Refusal::bad_request;
  }
  const std::uint64_t tag = command.tag;
  if (why == Refusal::none) {
    why = programming.begin(std::move(command), now);
  }
  if (why != Refusal::none) {
    refuse({.tag = tag, .kind = CommandKind::program}, why, now);
  }
  finish_program();
}

void Line::Impl::advance_program(Instant now) {
  loader.advance(now);
  programming.advance(now);
  finish_program();
}

void Line::Impl::end_program(Refusal why, Instant now) {
  programming.end(why, now);
  finish_program();
}

void Line::Impl::finish_program() {
  while (auto answer = programming.take_reply()) {
    reply(answer->tag, answer->error, std::move(answer->data));
  }
}

}  // namespace linegate::line
