// SPDX-License-Identifier: Apache-2.0
// The configuration manager's part in the line: the command `configure`, and requests by 1F25h.
#include "stack/line/line_impl.h"

namespace linegate::line {

void Line::Impl::start_configure(const Command& command, Instant now) {
  if (!manages()) {
    refuse(command, Refusal::wrong_role, now);
  } else if (!usable()) {
    refuse(command, Refusal::line_down, now);
  } else if (const Refusal why = configuring.begin(command, now); why != Refusal::none) {
    refuse(command, why, now);
  }
  finish_configure();
}

void Line::Impl::advance_configure(Instant now) {
  configurator.advance(now);
  configuring.carry_out_requests(now);
  configuring.advance(now);
  finish_configure();
}

void Line::Impl::end_configure(Refusal why) {
  configuring.end(why);
  finish_configure();
}

void Line::Impl::finish_configure() {
  if (auto answer = configuring.take_reply()) {
    reply(answer->tag, answer->error, std::move(answer->data));
  }
}

// The answers to a request by 1F25h (CiA 302-3).
AbortCode Line::Impl::may_configure(std::uint8_t id) const {
  if (!manages() || !manager.active()) {
    return AbortCode::local_control;
  }
  if (!manager.node(id).configured) {
    return AbortCode::invalid_value;
  }
  const bool booting = manager.node(id).boot == manager::kBootUnfinished;
  return booting ? AbortCode::device_state : AbortCode::none;
}

}  // namespace linegate::line
