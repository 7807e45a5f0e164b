// SPDX-License-Identifier: Apache-2.0
// Unconfirmed services, from the command to the acknowledgement on the bus.
#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/time.h"
#include "stack/line/line.h"

namespace linegate::line {

[[gnu::hot]] void Line::note_handed_out(const can::Frame& frame, Instant now, std::uint8_t from) {
  under_way_.handed_out(frame, now);
  if (under_way_.any()) [[unlikely]] {
    find_sendings(frame, from);
  }
}

bool Line::is_awaited(const FramesUnderWay::Awaited& awaited, const can::Frame& frame,
                      std::uint8_t from) const {
  constexpr std::size_t kMpdoHead = 4;  // bytes before the value
  if (awaited.number != 0 || awaited.device != from) {
    return false;
  }
  if (awaited.tpdo != 0) {
    return carries_newest(awaited, frame);
  }
  return awaited.any_value ? frame.id == awaited.frame.id && frame.flags == awaited.frame.flags &&
                                 std::equal(frame.data.begin(), frame.data.begin() + kMpdoHead,
                                            awaited.frame.data.begin())
                           : can::same_content(awaited.frame, frame);
}

// Matches the frame that was handed out last. Each of two equal commands has its own frame, and so
// does each of two equal events.
void Line::find_sendings(const can::Frame& frame, std::uint8_t from) {
  std::array<bool, 2> found{};  // of a command, of an event
  for (FramesUnderWay::Sending& sending : under_way_.sendings()) {
    bool& done = found[sending.is_report() ? 1 : 0];
    for (FramesUnderWay::Awaited& awaited : sending.frames) {
      if (done || !is_awaited(awaited, frame, from)) {
        continue;
      }
      awaited.number = under_way_.next_number() - 1;
      done = awaited.tpdo == 0 && !awaited.any_value;
    }
  }
}

[[gnu::hot]] void Line::acknowledged(std::uint64_t number, Instant now) {
  if (!under_way_.ended(number, now)) {
    return;
  }
  note_acknowledged(number, now);
  if (under_way_.any()) [[unlikely]] {
    std::erase_if(under_way_.sendings(), [&](FramesUnderWay::Sending& sending) {
      const bool sent = FramesUnderWay::is_sent(sending, number);
      if (sent && sending.is_report()) {
        sending.report.event.time = now;
        sending.report.events->emit(sending.report.event);
      } else if (sent) {
        reply(sending.command.tag, Error{}, FramesUnderWay::take_data(sending, number));
      }
      return sent;
    });
  }
}

void Line::lost(std::uint64_t first, std::uint64_t last) {
  mark_dirty();
  under_way_.lost(first, last);
  note_lost(first, last);
}

void Line::answer_when_sent(FramesUnderWay::Sending sending, Instant now) {
  Command& command = sending.command;
  if (!under_way_.expected()) {
    reply(command.tag, Error{}, std::move(sending.data));
    return;
  }
  if (under_way_.sendings().size() >= FramesUnderWay::kMost) {
    refuse(command, Refusal::busy, now);
    return;
  }
  // A longer time-out is that of an SDO transfer, and of who waits for this reply.
  const bool sooner = command.timeout > Duration::zero() && command.timeout < kSendTime;
  sending.deadline = earlier(sending.deadline, deadline(now, sooner ? command.timeout : kSendTime));
  under_way_.add(std::move(sending));
}

void Line::report_when_sent(std::uint8_t device, const can::Frame& frame, const Event& event,
                            EventLog& log) {
  if (is_silent()) {
    return;
  }
  if (!under_way_.expected()) {
    log.emit(event);
    return;
  }
  if (under_way_.sendings().size() >= FramesUnderWay::kMost) {
    return;  // nobody will know whether it was sent
  }
  under_way_.add({.command = {.request = EmcySend{}},
                  .frames = {{.frame = frame, .device = device}},
                  .report = {.events = &log, .event = event}});
}

// An answer may end other sendings: a prepare that is refused wakes the line.
void Line::expire_sendings(Instant now) {
  if (!under_way_.any()) {
    return;
  }
  std::vector<FramesUnderWay::Sending> expired;
  std::erase_if(under_way_.sendings(), [&](FramesUnderWay::Sending& sending) {
    const bool is_over = sending.deadline <= now;
    if (is_over) {
      expired.push_back(std::move(sending));
    }
    return is_over;
  });
  for (FramesUnderWay::Sending& sending : expired) {
    answer_unsent(sending, now);
  }
}

void Line::refuse_unsent(CommandKind kind, Refusal why, Instant now, std::uint8_t device) {
  std::erase_if(under_way_.sendings(), [&](const FramesUnderWay::Sending& sending) {
    const bool gone =
        line::kind(sending.command) == kind &&
        std::ranges::any_of(sending.frames, [device](const FramesUnderWay::Awaited& frame) {
          return frame.number == 0 && frame.device == device;
        });
    if (gone && !sending.is_report()) {
      refuse(sending.command, why, now);
    }
    return gone;
  });
}

void Line::refuse_gone(const std::function<bool(const Command&)>& is_gone, Refusal why,
                       Instant now) {
  for (const FramesUnderWay::Sending& sending : under_way_.give_up_values(is_gone)) {
    refuse(sending.command, why, now);
  }
}

void Line::cancel_sendings() {
  for (const FramesUnderWay::Sending& sending : under_way_.sendings()) {
    if (!sending.is_report()) {
      reply(sending.command.tag, to_error(Refusal::cancelled));
    }
  }
  under_way_.sendings().clear();
}

void Line::end_sendings(Instant now) {
  std::vector<FramesUnderWay::Sending> ended = std::exchange(under_way_.sendings(), {});
  for (FramesUnderWay::Sending& sending : ended) {
    if (!sending.is_report()) {
      answer_unsent(sending, now);
    }
  }
}

bool Line::bus_is_stuck(Instant now) const {
  return !usable() || under_way_.is_stuck(now);
}

bool Line::carries_newest(const FramesUnderWay::Awaited& /*awaited*/,
                          const can::Frame& /*frame*/) const {
  return false;
}

void Line::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  refuse(sending.command, Refusal::no_acknowledge, now);
}

}  // namespace linegate::line
