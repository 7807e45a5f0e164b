// SPDX-License-Identifier: Apache-2.0
// A channel for tests: the test supplies the received frames and inspects the sent ones.
#pragma once

#include <cerrno>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridges/can/channel.h"
#include "bridges/can/sendable.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::gateway {

class FakeChannel final : public can_bridge::Channel {
 public:
  int descriptor() const override { return -1; }
  std::size_t read(std::span<can::Frame> out, can_bridge::BusEvents& events, Instant now) override {
    ++reads;
    for (const auto& event : coming_events) {
      events.push(event);
    }
    coming_events.clear();
    std::size_t n = 0;
    while (n < out.size() && !coming.empty() && coming.front().time <= now + reading_takes) {
      out[n++] = coming.front();
      coming.pop_front();
    }
    events.frames_given(n);
    for (const auto& event : std::exchange(coming_later, {})) {
      events.push(event);
    }
    return n;
  }
  std::size_t write(std::span<const can::Frame> frames, Instant) override {
    if (on_write) {
      on_write();
    }
    std::size_t n = 0;
    while (n < frames.size() && accepts > 0) {
      const can::Frame& frame = frames[n++];
      --accepts;
      if (can_bridge::sendable(frame, fd)) {
        sent.push_back(frame);
        ++counted.sent;
      } else {
        ++counted.refused;
      }
    }
    if (acknowledges) {
      counted.acknowledged = counted.taken();
    }
    return n;
  }
  std::size_t room(Instant) const override { return promises.value_or(accepts); }
  bool wants_writable() const override { return false; }
  Instant next_wake() const override { return kNever; }
  const can_bridge::ChannelCounters& counters() const override { return counted; }
  can_bridge::ControllerSetup settings() const override { return set_to; }
  bool carries_fd() const override { return fd; }
  int restart(Instant) override {
    ++restarts;
    return restart_gives;
  }

  int fault(std::string_view change, std::string& said, Instant now) override {
    if (fault_gives == EOPNOTSUPP) {
      return Channel::fault(change, said, now);
    }
    said = "said of " + std::string(change);
    return fault_gives;
  }

  bool acknowledges = true;  // every sent frame counts as acknowledged at once
  std::deque<can::Frame> coming;
  std::vector<can::BusEvent> coming_events;  // precede the frames
  std::vector<can::BusEvent> coming_later;   // follow the frames
  std::vector<can::Frame> sent;
  std::function<void()> on_write;  // called before write() accepts any frame
  std::size_t accepts = 1000;
  bool fd = true;                       // whether it can send CAN FD frames; if not, it drops them
  std::optional<std::size_t> promises;  // the result of room(); absent: `accepts`
  int reads = 0;
  int restarts = 0;
  int restart_gives = 0;
  int fault_gives = EOPNOTSUPP;
  Duration reading_takes{};  // duration of read(); frames of that time are read, too
  can_bridge::ChannelCounters counted;
  can_bridge::ControllerSetup set_to;
};

}  // namespace linegate::gateway
