// SPDX-License-Identifier: Apache-2.0
// LSS in the role manager: when the network may boot, and commands.
#include <utility>

#include "stack/line/line_impl.h"

namespace linegate::line {

void Line::Impl::start_lss(Instant now) {
  node.dispatch().add(lss::kSlaveId, false, can::Service::lss, 0);
  lss.start(usable(), now);
  settle_lss(now);
}

// Takes up what the LSS master has come to: answers, and that the nodes may boot.
void Line::Impl::settle_lss(Instant now) {
  while (auto done = lss.take_reply()) {
    if (done->frame) {
      answer_when_sent({.command = {.tag = done->reply.tag, .kind = CommandKind::lss, .data = {}},
                        .frames = {{.frame = *done->frame}},
                        .data = std::move(done->reply.data),
                        .deadline = done->deadline},
                       now);
    } else {
      reply(done->reply.tag, done->reply.error, std::move(done->reply.data));
    }
  }
  if (manages() && running && !boot_begun && !lss.holds_boot()) {
    boot_begun = true;
    manager.start(now);
  }
}

void Line::Impl::execute_lss(Command command, Instant now) {
  if (!manages()) {
    refuse(command, Refusal::wrong_role, now);
  } else if (!usable()) {
    refuse(command, Refusal::line_down, now);
  } else if (!lss.execute(command, now)) {
    refuse(command, Refusal::busy, now);
  }
  settle_lss(now);
}

bool Line::Impl::next_lss_frame(can::Frame& out, std::uint64_t number, Instant now) {
  if (!lss.next_frame(out, number, now)) {
    return false;
  }
  settle_lss(now);
  return true;
}

}  // namespace linegate::line
