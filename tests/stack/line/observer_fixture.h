// SPDX-License-Identifier: Apache-2.0
// A line beside a foreign master: the test simulates the bus.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {

inline LineConfig observed(LineConfig config) {
  config.role = Role::observer;
  config.node_id = 0;
  return config;
}

inline std::vector<int> numbers(const image::Snapshot& snapshot) {
  std::vector<int> out;
  for (const std::byte b : snapshot.bytes) {
    out.push_back(std::to_integer<int>(b));
  }
  return out;
}

class ObserverTest : public LineTest {
 protected:
  void observe(const LineConfig& config) {
    make(observed(config));
    line_->start(now_);
  }

  void expect_silence() {
    can::Frame frame;
    ASSERT_FALSE(line_->wants_to_send(now_));
    ASSERT_FALSE(line_->next_frame(frame, now_)) << text(frame);
  }

  void hear_remote(std::uint32_t id) {
    can::Frame frame = can::make_frame(id, {});
    frame.flags |= can::Frame::kRemote;
    frame.length = 1;
    frame.time = now_;
    line_->receive(std::span(&frame, 1), now_);
  }

  std::vector<Event> of(EventKind kind) {
    std::vector<Event> all = events();
    std::erase_if(all, [&](const Event& e) { return e.kind() != kind; });
    return all;
  }
};

}  // namespace linegate::line
