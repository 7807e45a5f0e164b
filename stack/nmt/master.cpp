// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/master.h"

#include <algorithm>

#include "stack/can/cob_id.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"

namespace linegate::nmt {
namespace {

constexpr od::Address kInhibitTime{od::objects::kNmtInhibitTime, 0};
constexpr Duration kTick = std::chrono::microseconds(100);
constexpr std::size_t kMaxWaiting = 1024;

}  // namespace

Master::Master(can::TransmitQueue& transmit, const od::Dictionary* dictionary)
    : transmit_(transmit), dictionary_(dictionary) {
}

void Master::set_active(bool active) {
  active_ = active;
  if (active) {
    return;
  }
  waiting_.clear();
  (void)transmit_.remove(can::TransmitClass::nmt,
                         [](const can::Frame& frame) { return frame.id == can::kNmtId; });
}

bool Master::send(Command command, std::uint8_t node, Instant now) {
  if (!active_ || node > can::kMaxNodeId) {
    return false;
  }
  const NodeControl control{command, node};
  if (waiting_.empty() && free_at_ <= now) {
    return push(control, now);
  }
  if (waiting_.size() >= kMaxWaiting) {
    return false;
  }
  waiting_.push_back(control);
  return true;
}

bool Master::waits(const NodeControl& control) const {
  return std::ranges::any_of(waiting_, [&control](const NodeControl& each) {
    return each.command == control.command && each.node == control.node;
  });
}

// If the transmit queue is full, the command is retried later.
void Master::advance(Instant now) {
  while (!waiting_.empty() && free_at_ <= now) {
    if (!push(waiting_.front(), now)) {
      free_at_ = now + kTick;
      return;
    }
    waiting_.pop_front();
  }
}

Duration Master::inhibit_time() const {
  const auto ticks = dictionary_ == nullptr ? std::nullopt : dictionary_->number(kInhibitTime);
  return kTick * static_cast<Duration::rep>(ticks.value_or(0));
}

bool Master::push(const NodeControl& control, Instant now) {
  if (!transmit_.push(can::TransmitClass::nmt, encode(control))) {
    return false;
  }
  free_at_ = now + inhibit_time();
  return true;
}

}  // namespace linegate::nmt
