// SPDX-License-Identifier: Apache-2.0
// Outputs of one line that follow the inputs of another line.
#include "gateway/runtime/binder.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/exchange/wakeup.h"
#include "stack/can/frame.h"

#include "tests/gateway/plans.h"

namespace linegate::gateway {
namespace {

using image::Direction;

constexpr Instant kBinderNow{std::chrono::seconds(10)};

const std::string kBinderPlant = R"(schema: 1
lines:
  - name: field
    interface: virtual:field
    role: device
    devices: [{id: 5, name: io, profile: 401, digital_inputs: 2, digital_outputs: 2}]
  - name: plc
    interface: virtual:plc
    role: device
    devices:
      - id: 9
        name: image
        profile: 401
        digital_inputs: 2
        digital_outputs: 2
        bind:
          "6000:1": field/io.6200:1
          "6000:2": {entry: field/io.6200:2, when_lost: zero}
          "6200:1": field/io.6000:1
)";

class BinderTest : public testing::Test {
 protected:
  BinderTest() : plant_(make_plant(kBinderPlant)) {
    for (const auto& plan : plant_.lines) {
      lines_.push_back(make_line(plan));
      lines_.back()->start(kBinderNow);
      hear(*lines_.back(), 0x000, {0x01, 0x00});
      (void)sent(*lines_.back());
    }
    // Bindings by direction: two from "field" to "plc", one back.
    std::vector<config::Binding> there;
    std::vector<config::Binding> back;
    for (const auto& binding : plant_.bindings) {
      (binding.from == "field" ? there : back).push_back(binding);
    }
    EXPECT_EQ(there.size(), 2U);
    EXPECT_EQ(back.size(), 1U);
    there_ = std::make_unique<BoundLink>(std::move(there));
    back_ = std::make_unique<BoundLink>(std::move(back));
    there_->taker = &woken_;
    back_->taker = &woken_;
  }

  static void hear(line::Line& line, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can::Frame frame = can::make_frame(id, data);
    frame.time = kBinderNow;
    line.receive({&frame, 1}, kBinderNow);
  }
  static std::vector<std::pair<std::uint32_t, unsigned>> sent(line::Line& line) {
    std::vector<std::pair<std::uint32_t, unsigned>> out;
    for (can::Frame frame; line.next_frame(frame, kBinderNow);) {
      out.emplace_back(frame.id, std::to_integer<unsigned>(frame.data[0]) << 8U |
                                     std::to_integer<unsigned>(frame.data[1]));
    }
    return out;
  }
  line::Line& field() { return *lines_[0]; }
  line::Line& plc() { return *lines_[1]; }

  using Frames = std::vector<std::pair<std::uint32_t, unsigned>>;
  config::Plant plant_;
  std::vector<std::unique_ptr<line::Line>> lines_;
  exchange::Wakeup woken_;
  std::unique_ptr<BoundLink> there_;
  std::unique_ptr<BoundLink> back_;
};

TEST_F(BinderTest, AnInputIsSentByTheDeviceThatFollowsIt) {
  BoundSource source(*there_);
  BoundTarget target(*there_);
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  EXPECT_EQ(sent(plc()), Frames{}) << "no input has been received";
  hear(field(), 0x205, {0x12, 0x34});
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  EXPECT_EQ(sent(plc()), (Frames{{0x189, 0x1234}}));
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  EXPECT_EQ(sent(plc()), Frames{});
  // A value that was not taken is replaced by a newer one.
  hear(field(), 0x205, {0x13, 0x34});
  source.look(field(), kBinderNow);
  hear(field(), 0x205, {0x14, 0x35});
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  EXPECT_EQ(sent(plc()), (Frames{{0x189, 0x1435}}));
}

TEST_F(BinderTest, AnInputThatIsLostKeepsItsValueUnlessItShallBeZero) {
  BoundSource source(*there_);
  BoundTarget target(*there_);
  hear(field(), 0x205, {0x12, 0x34});
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  (void)sent(plc());
  hear(field(), 0x000, {0x80, 0x00});
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  EXPECT_EQ(sent(plc()), (Frames{{0x189, 0x1200}}));
  hear(field(), 0x000, {0x01, 0x00});
  hear(field(), 0x205, {0x12, 0x34});
  source.look(field(), kBinderNow);
  target.take(plc(), kBinderNow);
  EXPECT_EQ(sent(plc()), (Frames{{0x189, 0x1234}}));
}

TEST_F(BinderTest, WhatTheMasterSendsIsFollowedByAnOutput) {
  BoundSource source(*back_);
  BoundTarget target(*back_);
  hear(plc(), 0x209, {0x77, 0x00});
  source.look(plc(), kBinderNow);
  target.take(field(), kBinderNow);
  EXPECT_EQ(sent(field()), (Frames{{0x185, 0x7700}}));
}

TEST_F(BinderTest, ALineChangesWithWhatItIsBoundToAndNotWithItsName) {
  std::string text = kBinderPlant;
  const config::Plant other = make_plant(text.replace(text.find("id: 5"), 5, "id: 6"));
  EXPECT_NE(other.lines[1].source, plant_.lines[1].source);
  text = kBinderPlant;
  const config::Plant faster = make_plant(
      text.replace(text.find("interface: virtual:field"), 24, "interface: virtual:other"));
  EXPECT_NE(faster.lines[0].source, plant_.lines[0].source);
  EXPECT_EQ(faster.lines[1].source, plant_.lines[1].source);
}

}  // namespace
}  // namespace linegate::gateway
