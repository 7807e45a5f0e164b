// SPDX-License-Identifier: Apache-2.0
// Two lines on one bus, master and slave, sleep and wake together.
#include <memory>
#include <span>
#include <vector>

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using nmt::SleepPhase;

class SleepPair : public testing::Test {
 protected:
  struct Seat {
    std::unique_ptr<Line> line;
    std::size_t sent = 0;
    std::size_t lost = 0;  // heartbeats of the other one
  };

  static LineConfig config_of(Role role) {
    LineConfig config = config_with_axis();
    config.role = role;
    config.heartbeat = milliseconds(200);
    config.sleep = {.request = 0x690, .objection = 0x691};
    NodeConfig& node = config.nodes[0];
    config.node_id = role == Role::manager ? 127 : 5;
    node.id = role == Role::manager ? 5 : 127;
    node.boot = false;
    node.heartbeat = {};
    node.heartbeat_consumer = milliseconds(500);
    return config;
  }

  void SetUp() override {
    for (const Role role : {Role::manager, Role::device}) {
      auto made = Line::make(config_of(role));
      ASSERT_TRUE(made.ok()) << to_string(made.diagnostics.at(0));
      seats_.push_back({.line = *std::move(made.value)});
      seats_.back().line->start(now_);
    }
    pass(seconds(2));
    ASSERT_EQ(lost(), 0U);
  }

  // Each frame is on the bus for 250 us.
  void pass(Duration time) {
    for (const Instant end = now_ + time; now_ < end; now_ += std::chrono::microseconds(250)) {
      for (Seat& from : seats_) {
        from.line->advance(now_);
        count_events(from);
        can::Frame frame;
        if (from.line->next_frame(frame, now_)) {
          ++from.sent;
          frame.time = now_;
          for (Seat& to : seats_) {
            if (&to != &from) {
              to.line->receive(std::span(&frame, 1), now_);
            }
          }
        }
      }
    }
  }
  static void count_events(Seat& seat) {
    std::array<Event, 16> out;
    for (std::size_t i = 0, count = seat.line->pop_events(out); i < count; ++i) {
      seat.lost += out.at(i).kind() == EventKind::heartbeat_lost ? 1U : 0U;
    }
  }

  void ask(std::size_t seat, SleepAction action) {
    seats_[seat].line->execute({.tag = 1, .request = SleepRequest{action}}, now_);
  }
  std::vector<SleepPhase> phases() const {
    std::vector<SleepPhase> out;
    for (const Seat& seat : seats_) {
      out.push_back(seat.line->state().sleep.value_or(SleepPhase::awake));
    }
    return out;
  }
  std::size_t sent() const { return seats_[0].sent + seats_[1].sent; }
  std::size_t lost() const { return seats_[0].lost + seats_[1].lost; }

  Instant now_{seconds(100)};
  std::vector<Seat> seats_;
};

TEST_F(SleepPair, SleepsUntilOneOfThemWakes) {
  for (const std::size_t who : {std::size_t{0}, std::size_t{1}}) {
    ask(0, SleepAction::sleep);
    pass(seconds(3) + milliseconds(100));
    EXPECT_EQ(phases(), (std::vector{SleepPhase::asleep, SleepPhase::asleep}));
    const std::size_t before = sent();
    pass(seconds(30));
    EXPECT_EQ(sent(), before);
    ask(who, SleepAction::wake);
    pass(seconds(3));
    EXPECT_EQ(phases(), (std::vector{SleepPhase::awake, SleepPhase::awake}));
    EXPECT_EQ(lost(), 0U);
    for (std::size_t i = 0; i < seats_.size(); ++i) {
      EXPECT_EQ(seats_[i].line->node_state(i == 0 ? 5 : 127).presence, manager::Presence::present);
    }
  }
}

TEST_F(SleepPair, TheSlaveObjects) {
  ask(1, SleepAction::object);
  ask(0, SleepAction::sleep);
  pass(seconds(5));
  EXPECT_EQ(phases(), (std::vector{SleepPhase::awake, SleepPhase::awake}));
  Reply reply;
  ASSERT_TRUE(seats_[0].line->pop_reply(reply));
  EXPECT_EQ(reply.bytes(), std::vector{std::byte{5}});
  ask(0, SleepAction::prepare);
  pass(seconds(5));
  EXPECT_EQ(phases(), (std::vector{SleepPhase::awake, SleepPhase::awake}))
      << "its objection to prepare wakes both";
  EXPECT_EQ(lost(), 0U);
}

}  // namespace
}  // namespace linegate::line
