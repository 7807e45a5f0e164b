// SPDX-License-Identifier: Apache-2.0
// PDO forwarding: values received in a PDO of one line are sent in a PDO of another line.
#include <array>
#include <initializer_list>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/runtime/binder.h"
#include "gateway/runtime/line_runner.h"
#include "stack/can/frame.h"
#include "stack/od/dictionary.h"

#include "tests/gateway/plans.h"
#include "tests/gateway/runtime/fake_channel.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

// TPDO1 of a drive is 185h (6041h with 16 bits, 6061h with 8 bits), event-driven; TPDO2 is 285h
// (6064h, 606Ch), sent with every SYNC. RPDO1 is 205h (6040h, 6060h) and RPDO2 is 305h (607Ah,
// 60FFh), with the same transmission types.
std::string forwarding_plant(const std::string& rules) {
  return R"(schema: 1
lines:
  - name: press
    interface: virtual:press
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds, pdo_deadline: 50ms}]
  - name: hall
    interface: virtual:hall
    nodes: [{id: 5, name: axis, eds: bridges/sim/eds/drive.eds}]
forward:
)" + rules;
}

// The lines are slaves of another master, so that they need no boot.
config::Plant obeying_plant(const std::string& rules) {
  config::Plant out = make_plant(forwarding_plant(rules));
  for (auto& plan : out.lines) {
    plan.config.role = line::Role::device;
  }
  return out;
}

const std::string kStatusRules = R"(  - press.axis.6041:0 -> hall.axis.6040:0
  - press.axis.6061:0 -> hall.axis.6060:0
)";

const std::string kZeroRules =
    R"(  - {from: press.axis.6041:0, to: hall.axis.6040:0, when_lost: zero}
  - press.axis.6061:0 -> hall.axis.6060:0
)";

struct Sent {
  std::uint32_t id = 0;
  std::vector<unsigned> data;
  bool operator==(const Sent&) const = default;
};

class ForwardingTest : public testing::Test {
 protected:
  void make(const std::string& rules) {
    plant_ = obeying_plant(rules);
    for (const auto& plan : plant_.lines) {
      lines_.push_back(make_line(plan));
      lines_.back()->start(now_);
      hear(*lines_.back(), 0x000, {0x01, 0x00});
      (void)sent(*lines_.back());
    }
    link_ = std::make_unique<BoundLink>(plant_.bindings);
    link_->taker = &woken_;
    source_ = std::make_unique<BoundSource>(*link_);
    target_ = std::make_unique<BoundTarget>(*link_);
  }

  void hear(line::Line& line, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    now_ += 1us;
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    line.receive({&frame, 1}, now_);
  }
  void hand_over() {
    source_->look(press(), now_);
    target_->take(hall(), now_);
  }
  std::vector<Sent> sent(line::Line& line) {
    std::vector<Sent> out;
    for (can::Frame frame; line.next_frame(frame, now_);) {
      Sent& one = out.emplace_back(Sent{frame.id, {}});
      for (std::size_t i = 0; i < frame.length; ++i) {
        one.data.push_back(std::to_integer<unsigned>(frame.data[i]));
      }
    }
    return out;
  }
  void pass(Duration time) {
    now_ += time;
    press().advance(now_);
    hall().advance(now_);
  }
  line::Line& press() { return *lines_[0]; }
  line::Line& hall() { return *lines_[1]; }

  Instant now_{10s};
  config::Plant plant_;
  std::vector<std::unique_ptr<line::Line>> lines_;
  exchange::Wakeup woken_;
  std::unique_ptr<BoundLink> link_;
  std::unique_ptr<BoundSource> source_;
  std::unique_ptr<BoundTarget> target_;
};

TEST_F(ForwardingTest, EveryReceivedPdoIsAnEventOfTheOther) {
  make(kStatusRules);
  hand_over();
  EXPECT_EQ(sent(hall()), std::vector<Sent>{}) << "nothing was received";
  hear(press(), 0x185, {0x37, 0x12, 0x08});
  hand_over();
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {0x37, 0x12, 0x08}}}));
  hand_over();
  EXPECT_EQ(sent(hall()), std::vector<Sent>{});
  hear(press(), 0x185, {0x37, 0x12, 0x08});
  hand_over();
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {0x37, 0x12, 0x08}}}))
      << "the same values are sent again";
}

TEST_F(ForwardingTest, TheNewestValuesCountAndThoseOfOnePdoStayTogether) {
  make(kStatusRules);
  hear(press(), 0x185, {0x01, 0x00, 0x01});
  source_->look(press(), now_);
  hear(press(), 0x185, {0x02, 0x00, 0x02});
  hand_over();
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {0x02, 0x00, 0x02}}}));
}

TEST_F(ForwardingTest, EachSideKeepsItsSync) {
  make(R"(  - press.axis.6064:0 -> hall.axis.607A:0
  - press.axis.606C:0 -> hall.axis.60FF:0
)");
  hear(press(), 0x285, {1, 0, 0, 0, 2, 0, 0, 0});
  hand_over();
  hear(hall(), 0x080, {});
  EXPECT_EQ(sent(hall()), std::vector<Sent>{}) << "the source has had no SYNC";
  hear(press(), 0x080, {});
  hand_over();
  EXPECT_EQ(sent(hall()), std::vector<Sent>{}) << "the target has had no SYNC since";
  hear(hall(), 0x080, {});
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x305, {1, 0, 0, 0, 2, 0, 0, 0}}}));
}

TEST_F(ForwardingTest, TheTargetKeepsItsInhibitTime) {
  make(kStatusRules);
  ASSERT_TRUE(hall().dictionary().set({0x1800, 3}, 100U));  // 10 ms
  for (const std::uint8_t value : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}}) {
    hear(press(), 0x185, {value, 0, 0});
    hand_over();
  }
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {3, 0, 0}}}));
  hear(press(), 0x185, {4, 0, 0});
  hand_over();
  EXPECT_EQ(sent(hall()), std::vector<Sent>{});
  pass(11ms);
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {4, 0, 0}}}));
}

TEST_F(ForwardingTest, ASourceThatIsLateIsHeldZeroOrStopsTheTarget) {
  make(kZeroRules);
  hear(press(), 0x185, {0x37, 0x12, 0x08});
  hand_over();
  (void)sent(hall());
  pass(60ms);
  hand_over();
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {0, 0, 0x08}}}));
  hear(press(), 0x185, {0x37, 0x12, 0x08});
  hand_over();
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {0x37, 0x12, 0x08}}}));
}

TEST_F(ForwardingTest, ASourceThatIsLateMayStopTheTarget) {
  make(R"(  - {from: press.axis.6041:0, to: hall.axis.6040:0, when_lost: stop}
  - press.axis.6061:0 -> hall.axis.6060:0
)");
  ASSERT_TRUE(hall().dictionary().set({0x1800, 5}, 20U));  // event timer
  hear(press(), 0x185, {0x37, 0x12, 0x08});
  hand_over();
  (void)sent(hall());
  pass(21ms);
  EXPECT_EQ(sent(hall()).size(), 1U) << "the event timer repeats it";
  pass(40ms);
  hand_over();
  (void)sent(hall());
  pass(21ms);
  EXPECT_EQ(sent(hall()), std::vector<Sent>{});
  hear(press(), 0x185, {0x38, 0x12, 0x08});
  hand_over();
  EXPECT_EQ(sent(hall()), (std::vector<Sent>{{0x205, {0x38, 0x12, 0x08}}}));
}

// For ThreadSanitizer: with two executors, the values of one PDO stay together.
TEST_F(ForwardingTest, AcrossExecutorsNoPdoIsTorn) {
  make(kStatusRules);
  constexpr unsigned kPdos = 20'000;
  std::thread giver([this] {
    Instant time = now_;
    for (unsigned i = 1; i <= kPdos; ++i) {
      time += 1us;
      const auto low = static_cast<std::uint8_t>(i);
      can::Frame frame = can::make_frame(0x185, {low, static_cast<std::uint8_t>(i >> 8U), low});
      frame.time = time;
      press().receive({&frame, 1}, time);
      source_->look(press(), time);
    }
  });
  unsigned last = 0;
  unsigned torn = 0;
  unsigned backwards = 0;
  while (last != kPdos) {
    target_->take(hall(), now_);
    for (can::Frame frame; hall().next_frame(frame, now_);) {
      const auto low = std::to_integer<unsigned>(frame.data[0]);
      const unsigned value = low | std::to_integer<unsigned>(frame.data[1]) << 8U;
      torn += low == std::to_integer<unsigned>(frame.data[2]) ? 0U : 1U;
      backwards += value < last ? 1U : 0U;
      last = value;
    }
  }
  giver.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(backwards, 0U);
}

class ForwardingCallTest : public testing::Test {
 protected:
  ForwardingCallTest() : plant_(obeying_plant(kZeroRules)) {
    link_ = std::make_unique<BoundLink>(plant_.bindings);
    for (std::size_t i = 0; i < 2; ++i) {
      auto channel = std::make_unique<FakeChannel>();
      channels_[i] = channel.get();
      const config::LinePlan& plan = plant_.lines.at(i);
      runners_[i] = std::make_unique<LineRunner>(make_line(plan), std::move(channel), plan,
                                                 ports_[i], consumer_);
    }
    link_->runner = runners_[1].get();
    runners_[0]->bind({BoundSource(*link_)}, {});
    runners_[1]->bind({}, {BoundTarget(*link_)});
  }

  void begin(std::size_t line) {
    can::BusEvent event;
    event.kind = can::BusEvent::Kind::interface_ready;
    event.time = now_;
    channels_[line]->coming_events.push_back(event);
    runners_[line]->service(now_);
    come(line, 0x000, {0x01, 0x00});
    runners_[line]->service(now_);
    channels_[line]->sent.clear();
  }
  void come(std::size_t line, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    now_ += 1us;
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    channels_[line]->coming.push_back(frame);
  }

  Instant now_{10s};
  config::Plant plant_;
  std::unique_ptr<BoundLink> link_;
  std::array<LinePort, 2> ports_;
  exchange::Wakeup consumer_;
  std::array<FakeChannel*, 2> channels_{};
  std::array<std::unique_ptr<LineRunner>, 2> runners_;
};

TEST_F(ForwardingCallTest, OnOneExecutorTheHandOverIsACallThatSends) {
  begin(0);
  begin(1);
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  ASSERT_EQ(channels_[1]->sent.size(), 1U);
  EXPECT_EQ(channels_[1]->sent[0].id, 0x205U);
  EXPECT_EQ(channels_[1]->sent[0].data[2], std::byte{0x08});
}

TEST_F(ForwardingCallTest, WhatCameIsSentOnBeforeAnythingElseIsDone) {
  begin(0);
  begin(1);
  const std::size_t all = ports_[0].commands.room();
  line::Command command{.request = line::CanListen{}};
  ports_[0].commands.push(command);
  come(0, 0x185, {0x37, 0x12, 0x08});
  std::size_t room_then = 0;
  channels_[1]->on_write = [&] { room_then = ports_[0].commands.room(); };
  runners_[0]->called();
  runners_[0]->service(now_);
  EXPECT_EQ(channels_[1]->sent.size(), 1U);
  EXPECT_EQ(room_then, all - 1) << "the command must still be queued when the frame is sent";
  EXPECT_EQ(ports_[0].commands.room(), all) << "then it is executed";
}

// Changes that a timer causes are forwarded in the same round, after those that frames cause.
TEST_F(ForwardingCallTest, WhatATimeOutChangesIsSentOnToo) {
  begin(0);
  begin(1);
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  channels_[1]->sent.clear();
  now_ += 60ms;  // its deadline is 50 ms
  runners_[0]->service(now_);
  ASSERT_EQ(channels_[1]->sent.size(), 1U);
  EXPECT_EQ(channels_[1]->sent[0].data[0], std::byte{0});
  EXPECT_EQ(channels_[1]->sent[0].data[2], std::byte{0x08}) << "the other value is unchanged";

  come(0, 0x185, {0x38, 0x12, 0x08});
  now_ += 60ms;  // the deadline of 50 ms passed before the thread read the frame
  runners_[0]->service(now_);
  ASSERT_EQ(channels_[1]->sent.size(), 3U);
  EXPECT_EQ(channels_[1]->sent[1].data[0], std::byte{0x38});
  EXPECT_EQ(channels_[1]->sent[2].data[0], std::byte{0});
}

// The thread was delayed between finding the descriptor not ready and reading the clock.
TEST_F(ForwardingCallTest, ReadsBeforeATimeOutEvenAChannelThatHadNothingToRead) {
  begin(0);
  begin(1);
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  now_ += 40ms;
  come(0, 0x185, {0x38, 0x12, 0x08});
  now_ += 20ms;  // the deadline of the first frame is 50 ms
  runners_[0]->nothing_to_read();
  runners_[0]->service(now_);
  ASSERT_EQ(channels_[1]->sent.size(), 2U);
  EXPECT_EQ(channels_[1]->sent[1].data[0], std::byte{0x38});
}

TEST_F(ForwardingCallTest, ALineThatBeginsLaterTakesTheNewestValues) {
  begin(0);
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  begin(1);
  runners_[1]->service(now_);
  come(0, 0x185, {0x38, 0x12, 0x08});
  runners_[0]->service(now_);
  ASSERT_EQ(channels_[1]->sent.size(), 1U);
  EXPECT_EQ(channels_[1]->sent[0].data[0], std::byte{0x38});
}

TEST_F(ForwardingCallTest, ASourceThatIsAddedIsReadThoughNothingIsReceived) {
  begin(0);
  begin(1);
  runners_[0]->unbind(*link_, now_);
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  EXPECT_TRUE(channels_[1]->sent.empty());
  runners_[0]->bind(BoundSource(*link_));
  runners_[0]->service(now_);
  ASSERT_EQ(channels_[1]->sent.size(), 1U);
  EXPECT_EQ(channels_[1]->sent[0].data[0], std::byte{0x37});
}

TEST_F(ForwardingCallTest, WhatTheInterfaceDoesNotTakeIsSentWhenItDoes) {
  begin(0);
  begin(1);
  channels_[1]->accepts = 0;
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  EXPECT_TRUE(channels_[1]->sent.empty());
  channels_[1]->accepts = 10;
  runners_[1]->service(now_);
  EXPECT_EQ(channels_[1]->sent.size(), 1U);
}

TEST_F(ForwardingCallTest, ValuesOfAnotherExecutorAreSentWithoutReadingTheChannel) {
  link_->runner = nullptr;
  exchange::Wakeup executor;
  link_->taker = &executor;
  begin(0);
  begin(1);
  EXPECT_FALSE(runners_[1]->has_values());
  come(0, 0x185, {0x37, 0x12, 0x08});
  runners_[0]->service(now_);
  EXPECT_TRUE(runners_[1]->has_values());
  const int reads = channels_[1]->reads;
  runners_[1]->nothing_to_read();
  runners_[1]->service(now_);
  EXPECT_EQ(channels_[1]->sent.size(), 1U);
  EXPECT_EQ(channels_[1]->reads, reads);
  EXPECT_FALSE(runners_[1]->has_values());
}

// Publishing images at once would take the processor from the other executor. Images are delayed
// once only, even if more PDOs are forwarded meanwhile.
TEST_F(ForwardingCallTest, ImagesWaitAMomentForAnotherExecutor) {
  link_->runner = nullptr;
  exchange::Wakeup executor;
  link_->taker = &executor;
  begin(0);
  begin(1);
  auto& images = ports_[0].image(image::Direction::inputs);
  while (images.fetch() != nullptr) {
  }
  const auto forward = [&](std::uint8_t value) {
    come(0, 0x185, {value, 0x12, 0x08});
    runners_[0]->service(now_);
  };
  now_ += 20ms;
  forward(0x37);
  EXPECT_EQ(images.fetch(), nullptr);
  EXPECT_EQ(runners_[0]->next_wake(), now_ + 100us);
  now_ += 60us;
  forward(0x38);
  EXPECT_EQ(images.fetch(), nullptr);
  now_ += 38us;  // plus 1 us in each come()
  forward(0x39);
  EXPECT_NE(images.fetch(), nullptr) << "images are delayed only once";

  now_ += 20ms;
  forward(0x37);
  EXPECT_EQ(images.fetch(), nullptr);
  now_ += 100us;
  runners_[0]->service(now_);
  EXPECT_NE(images.fetch(), nullptr);
}

// The same on one executor, for both lines: the next frame does not wait for the images.
TEST_F(ForwardingCallTest, ImagesWaitAMomentForTheNextFrame) {
  begin(0);
  begin(1);
  auto& inputs = ports_[0].image(image::Direction::inputs);
  auto& outputs = ports_[1].image(image::Direction::outputs);
  for (int i = 0; i < 3; ++i) {
    now_ += 20ms;
    runners_[0]->service(now_);
    runners_[1]->service(now_);
    (void)inputs.fetch();
    (void)outputs.fetch();
    come(0, 0x185, {static_cast<std::uint8_t>(0x37 + i), 0x12, 0x08});
    runners_[0]->service(now_);
    EXPECT_EQ(channels_[1]->sent.size(), static_cast<std::size_t>(i) + 1);
    EXPECT_EQ(inputs.fetch(), nullptr);
    EXPECT_EQ(runners_[0]->next_wake(), now_ + 100us);
    EXPECT_EQ(runners_[1]->next_wake(), now_ + 100us);
    now_ += 100us;
    runners_[0]->service(now_);
    runners_[1]->service(now_);
    EXPECT_NE(inputs.fetch(), nullptr);
    EXPECT_NE(outputs.fetch(), nullptr);
    EXPECT_GT(runners_[1]->next_wake(), now_);
  }
}

}  // namespace
}  // namespace linegate::gateway
