// SPDX-License-Identifier: Apache-2.0
// The scan of a line: who is there, and what they say of themselves.
#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/base/deadline.h"
#include "stack/line/line_impl.h"
#include "stack/scan/report.h"
#include "stack/scan/set_up.h"

namespace linegate::line {

void Line::Impl::start_scan(const Command& command, Instant now) {
  const bool one = command.node != 0;
  const bool apply = command.kind == CommandKind::scan_apply;
  if (command.node > can::kMaxNodeId || (one && command.node == config.node_id) ||
      (apply && command.code > (kScanSetUp | kScanRestore))) {
    refuse(command, Refusal::bad_request, now);
  } else if (!manages()) {
    refuse(command, Refusal::wrong_role, now);
  } else if (apply && !config.nodes.empty() && config.scanned.empty()) {
    refuse(command, Refusal::wrong_state, now);
  } else if (!usable()) {
    refuse(command, Refusal::line_down, now);
  } else if (!begin_scan(command.node, apply ? command.code : std::uint16_t{0}, now)) {
    refuse(command, Refusal::busy, now);
  } else {
    scan_tag = command.tag;
    scan_deadline = command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
    take_completions(now);
    finish_scan();
  }
}

// Nobody waits for what it finds. False if another one runs.
bool Line::Impl::begin_scan(std::uint8_t id, std::uint16_t code, Instant now) {
  const bool one = id != 0;
  if (!scanner.begin({.first = one ? id : can::kMinNodeId,
                      .last = one ? id : can::kMaxNodeId,
                      .except = config.node_id,
                      .timeout = config.sdo_timeout,
                      .restore_defaults = (code & kScanRestore) != 0},
                     now)) {
    return false;
  }
  if ((code & kScanRestore) != 0) {
    manager.stop(now);  // it would configure the nodes that come back
  }
  scan_tag.reset();
  scan_deadline = kNever;
  scan_of_all = !one;
  scan_code = code;
  diagnosis.scan_begins(id);
  return true;
}

void Line::Impl::finish_scan() {
  auto found = scanner.take_result();
  if (!found) {
    return;
  }
  scan_deadline = kNever;
  diagnosis.scan_ends();
  if ((scan_code & kScanSetUp) != 0) {
    scan::set_up(*found, canopen_ia.settings().heartbeat);
  }
  if (scan_tag) {
    reply(*scan_tag, Error{}, scan::write_report(*found));
  }
  for (scan::ScannedNode& fresh : *found) {
    const auto known = std::ranges::lower_bound(scan_cache, fresh.id, {}, &scan::ScannedNode::id);
    if (known != scan_cache.end() && known->id == fresh.id) {
      *known = std::move(fresh);
    } else {
      scan_cache.insert(known, std::move(fresh));
    }
  }
}

void Line::Impl::expire_scan(Instant now) {
  if (scan_deadline <= now) {
    end_scan(Refusal::timed_out, now);
    if (manager.state() == ManagerState::stopped) {
      manager.start(now);
    }
  }
}

void Line::Impl::end_scan(Refusal why, Instant now) {
  if (!scanner.active()) {
    return;
  }
  scanner.cancel(now);
  (void)scanner.take_result();
  scan_deadline = kNever;
  diagnosis.scan_ends();
  if (scan_tag) {
    reply(*scan_tag, to_error(why));
  }
}

void Line::Impl::reset_node(std::uint8_t id, Instant now) {
  nmt.send(nmt::Command::reset_node, id, now);
  manager.sent(nmt::Command::reset_node, id, now);
  note_command(nmt::Command::reset_node, id);
}

void Line::Impl::asked(std::uint8_t id, bool answered, Instant asked_at, Instant now) {
  manager.scanned(id, answered, asked_at, now);
}

// The image is made of what a scan found: whoever knew the line before knows another one.
void Line::Impl::tell_found_layout(Instant now) {
  if (config.scanned.empty()) {
    return;
  }
  Event event{.time = now, .kind = EventKind::layout_changed, .length = 16};
  store_le(event.data.data(), layout(image::Direction::inputs).id);
  store_le(event.data.data() + 8, layout(image::Direction::outputs).id);
  events.emit(event);
}

const std::vector<std::byte>* Line::Impl::cached(std::uint8_t id, od::Address address) const {
  const auto known = std::ranges::find(scan_cache, id, &scan::ScannedNode::id);
  return known == scan_cache.end() ? nullptr : known->find(address);
}

void Line::Impl::forget_cached(std::uint8_t id, od::Address address) {
  const auto known = std::ranges::find(scan_cache, id, &scan::ScannedNode::id);
  if (known != scan_cache.end()) {
    std::erase_if(known->values, [&](const auto& value) { return value.address == address; });
  }
}

}  // namespace linegate::line
