// Services that are not confirmed, from the command to the acknowledgement on the bus.
#include <algorithm>
#include <utility>

#include "stack/base/deadline.h"
#include "stack/line/line_impl.h"

namespace linegate::line {

void Line::Impl::expect_acknowledgements() {
  under_way.expect();
}

[[gnu::hot]] void Line::Impl::hand_out(const can::Frame& frame, Instant now) {
  under_way.handed_out(now);
  if (under_way.any()) [[unlikely]] {
    find_sendings(frame);
  }
}

// The frame that was handed out last.
void Line::Impl::find_sendings(const can::Frame& frame) {
  for (FramesUnderWay::Sending& sending : under_way.sendings()) {
    const bool is_its = sending.tpdo != 0 ? node.pdos().carries_newest(sending.tpdo, frame)
                                          : can::same_content(sending.frame, frame);
    if (sending.number == 0 && is_its) {
      sending.number = under_way.next_number() - 1;
      if (sending.tpdo == 0) {
        return;  // of two equal commands each has its frame
      }
    }
  }
}

[[gnu::hot]] void Line::Impl::acknowledged(std::uint64_t number, Instant now) {
  if (!under_way.ended(number, now)) {
    return;
  }
  node.pdos().acknowledged(number);
  if (lss.listens()) [[unlikely]] {
    lss.acknowledged(number, now);
  }
  if (under_way.any()) [[unlikely]] {
    std::erase_if(under_way.sendings(), [&](FramesUnderWay::Sending& sending) {
      const bool sent = sending.number != 0 && sending.number <= number;
      if (sent) {
        reply(sending.command.tag, Error{}, std::move(sending.data));
      }
      return sent;
    });
  }
}

void Line::Impl::lost(std::uint64_t first, std::uint64_t last) {
  under_way.lost(first, last);
  node.pdos().lost(first, last);
  lss.lost(first, last);
}

// The reply is that of the command when its frame is acknowledged.
void Line::Impl::answer_when_sent(FramesUnderWay::Sending sending, Instant now) {
  Command& command = sending.command;
  if (!under_way.expected()) {
    reply(command.tag, Error{}, std::move(sending.data));
    return;
  }
  if (under_way.sendings().size() >= FramesUnderWay::kMost) {
    refuse(command, Refusal::busy, now);
    return;
  }
  command.data.clear();
  // A longer time-out is that of an SDO transfer, and of who waits for this reply.
  const bool sooner = command.timeout > Duration::zero() && command.timeout < kSendTime;
  sending.deadline = deadline(now, sooner ? command.timeout : kSendTime);
  under_way.add(std::move(sending));
}

void Line::Impl::expire_sendings(Instant now) {
  std::erase_if(under_way.sendings(), [&](FramesUnderWay::Sending& sending) {
    if (sending.deadline > now) {
      return false;
    }
    if (sending.tpdo == 0) {
      refuse(sending.command, Refusal::no_acknowledge, now);
    } else {
      answer_unsent(sending, now);
    }
    return true;
  });
}

// Of a value: what its PDO waits for at present.
void Line::Impl::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  const std::uint8_t receiving = image.node_of(image::Direction::outputs, sending.tpdo);
  if (!takes_single_writes(receiving)) {
    sending.command.node = receiving;
    refuse(sending.command, Refusal::wrong_state, now);
    return;
  }
  PdoWait wait = wait_of(sending.tpdo);
  if (wait == PdoWait::none) {
    wait = sending.number != 0 || bus_is_stuck(now) ? PdoWait::bus : PdoWait::turn;
  }
  reply(sending.command.tag, Error{}, way_of(sending.tpdo, wait));
}

void Line::Impl::cancel_sendings() {
  for (const FramesUnderWay::Sending& sending : under_way.sendings()) {
    reply(sending.command.tag, to_error(Refusal::cancelled));
  }
  under_way.sendings().clear();
}

bool Line::Impl::bus_is_stuck(Instant now) const {
  return !usable() || under_way.is_stuck(now);
}

// --- Line ---------------------------------------------------------------------------------------

void Line::expect_acknowledgements() {
  impl_->expect_acknowledgements();
}

[[gnu::hot]] void Line::acknowledged(std::uint64_t number, Instant now) {
  impl_->acknowledged(number, now);
}

void Line::lost(std::uint64_t first, std::uint64_t last) {
  impl_->stir();
  impl_->lost(first, last);
}

}  // namespace linegate::line
