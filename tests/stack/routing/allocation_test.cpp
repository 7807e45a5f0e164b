// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/bench/allocations.h"
#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing::test {
namespace {

class RoutedAllocations : public RoutedLines {
 protected:
  // Receives a frame on one line and returns the number of allocations until the other line has
  // sent its frames.
  std::uint64_t forward(unsigned from, std::uint32_t id, std::uint8_t first) {
    can::Frame frame = can::make_frame(id, {first, 1, 2, 3, 4, 5, 6, 7});
    frame.time = now_;
    const std::uint64_t before = bench::allocations();
    line(from).receive(std::span(&frame, 1), now_);
    carry();
    line(1).advance(now_);
    line(2).advance(now_);
    carry();
    const bool sent = line(3 - from).next_frame(frame, now_);
    const std::uint64_t made = bench::allocations() - before;
    EXPECT_TRUE(sent) << "not forwarded";
    return made;
  }
};

TEST_F(RoutedAllocations, ForwardingAFrameMakesNone) {
  start();
  hear(1, 0x67F, {0xE0, 2, 0, 5, 1, 0, 0, 0});
  hear(1, 0x67F, {0xC6, 0, 0x20, 0, 0xA0, 2, 0, 0});
  hear(2, 0x585, {0xA4, 0, 0x20, 0, 127, 0, 0, 0});
  (void)sent(1);
  (void)sent(2);
  for (std::uint8_t segment = 1; segment <= 100; ++segment) {
    EXPECT_EQ(forward(1, 0x67F, segment), 0U);
  }
  hear(1, 0x67F, {0x80, 0, 0x20, 0, 0, 0, 0, 8});
  (void)sent(2);
  hear(1, 0x67F, {0xE0, 2, 0, 5, 1, 0, 0, 0});
  pass(milliseconds(1));
  hear(1, 0x67F, {0x40, 0, 0x20, 0, 0, 0, 0, 0});
  hear(2, 0x585, {0x41, 0, 0x20, 0, 0xA0, 2, 0, 0});
  (void)sent(1);
  (void)sent(2);
  for (int segment = 0; segment < 50; ++segment) {
    const bool toggle = segment % 2 != 0;
    EXPECT_EQ(forward(1, 0x67F, toggle ? 0x70 : 0x60), 0U);
    EXPECT_EQ(forward(2, 0x585, toggle ? 0x10 : 0x00), 0U);
  }
}

}  // namespace
}  // namespace linegate::routing::test
