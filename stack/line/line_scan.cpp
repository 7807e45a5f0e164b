// The scan of a line: who is there, and what they say of themselves.
#include "stack/base/deadline.h"
#include "stack/line/line_impl.h"
#include "stack/scan/report.h"

namespace linegate::line {

void Line::Impl::start_scan(const Command& command, Instant now) {
  const bool one = command.node != 0;
  if (command.node > can::kMaxNodeId || (one && command.node == config.node_id)) {
    refuse(command, Refusal::bad_request, now);
  } else if (!manages()) {
    refuse(command, Refusal::wrong_role, now);
  } else if (!usable()) {
    refuse(command, Refusal::line_down, now);
  } else if (!scanner.begin(one ? command.node : can::kMinNodeId,
                            one ? command.node : can::kMaxNodeId, config.node_id,
                            config.sdo_timeout, now)) {
    refuse(command, Refusal::busy, now);
  } else {
    scan_tag = command.tag;
    scan_of_all = !one;
    diagnosis.scan_begins(command.node);
    scan_deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
    take_completions(now);
    finish_scan();
  }
}

void Line::Impl::finish_scan() {
  if (const auto found = scanner.take_result()) {
    scan_deadline = kNever;
    reply(scan_tag, Error{}, scan::write_report(*found));
  }
}

void Line::Impl::expire_scan(Instant now) {
  if (scan_deadline <= now) {
    end_scan(Refusal::timed_out, now);
  }
}

void Line::Impl::end_scan(Refusal why, Instant now) {
  if (!scanner.active()) {
    return;
  }
  scanner.cancel(now);
  (void)scanner.take_result();
  scan_deadline = kNever;
  reply(scan_tag, to_error(why));
}

}  // namespace linegate::line
