// SPDX-License-Identifier: Apache-2.0
// For tests on real SocketCAN: a channel that is driven like by an executor.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>

#include "bridges/can/socketcan.h"

namespace linegate::can_bridge {

inline constexpr Duration kPatience = std::chrono::seconds(10);

inline Instant now() {
  return Instant(std::chrono::steady_clock::now().time_since_epoch());
}

inline void shell(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

class Driven {
 public:
  explicit Driven(const std::string& interface, std::size_t depth = 8)
      : Driven(interface, with_depth(depth)) {}
  Driven(const std::string& interface, SocketOptions options) {
    options.retry_period = std::chrono::milliseconds(50);
    channel_ = open_socketcan(interface, options);
    turn(Duration{});
  }

  static SocketOptions with_depth(std::size_t depth) {
    SocketOptions options;
    options.queue_depth = depth;
    return options;
  }

  // Waits until the channel needs service, at most `longest`, and reads.
  void turn(Duration longest) {
    const Duration until_wake = channel_->next_wake() == kNever
                                    ? longest
                                    : std::min(longest, channel_->next_wake() - now());
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(until_wake).count();
    pollfd entry{channel_->descriptor(),
                 static_cast<short>(POLLIN | (channel_->wants_writable() ? POLLOUT : 0)), 0};
    ::poll(&entry, 1, static_cast<int>(std::max<std::int64_t>(ms, 0)));
    std::array<can::Frame, 64> out;
    BusEvents told;
    const std::size_t count = channel_->read(out, told, now());
    frames.insert(frames.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count));
    events.insert(events.end(), told.view().begin(), told.view().end());
  }

  template <class Predicate>
  bool until(Predicate predicate) {
    const Instant deadline = now() + kPatience;
    while (!predicate()) {
      if (now() > deadline) {
        return false;
      }
      turn(std::chrono::milliseconds(50));
    }
    return true;
  }

  void send_all(std::span<const can::Frame> all) {
    const Instant deadline = now() + kPatience;
    while (!all.empty() && now() < deadline) {
      const std::size_t room = std::min(channel_->room(now()), all.size());
      all = all.subspan(channel_->write(all.first(room), now()));
      if (!all.empty()) {
        turn(std::chrono::milliseconds(50));
      }
    }
    EXPECT_TRUE(all.empty());
  }

  bool told(can::BusEvent::Kind kind, std::uint32_t code = 0) const {
    for (const can::BusEvent& event : events) {
      if (event.kind == kind && event.code == code) {
        return true;
      }
    }
    return false;
  }

  Channel& channel() { return *channel_; }

  std::vector<can::Frame> frames;
  std::vector<can::BusEvent> events;

 private:
  std::unique_ptr<Channel> channel_;
};

}  // namespace linegate::can_bridge
