// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/line_history.h"

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

TEST(LineHistory, NumbersAndCountersGoOnAfterARestart) {
  LineHistory history;
  history.restart();  // the first start of the line
  Event event;
  for (event.number = 1; event.number <= 3; ++event.number) {
    Event told = event;
    history.correct(told);
    EXPECT_EQ(told.number, event.number);
  }
  line::LineState state;
  state.counters.frames_received = 10;
  state.counters.events_lost = 1;
  state.routing.opened = 3;
  state.routing.open = 1;
  history.correct(state);
  EXPECT_EQ(state.counters.frames_received, 10U);

  history.restart();
  event = {};
  event.number = 1;
  history.correct(event);
  EXPECT_EQ(event.number, 4U);
  Event lost{.number = 4, .data = event::EventsLost{.first = 2, .last = 3}};
  history.correct(lost);
  EXPECT_EQ(lost.number, 7U);
  EXPECT_EQ(lost.data, EventData(event::EventsLost{.first = 5, .last = 6}));
  for (const std::uint64_t frames : {2U, 5U}) {
    line::LineState again;
    again.counters.frames_received = frames;
    again.routing.opened = 1;
    history.correct(again);
    EXPECT_EQ(again.counters.frames_received, 10U + frames);
    EXPECT_EQ(again.counters.events_lost, 1U);
    EXPECT_EQ(again.routing.opened, 4U);
    EXPECT_EQ(again.routing.open, 0U) << "connections end with their line";
  }

  history.restart();
  state = {};
  history.correct(state);
  EXPECT_EQ(state.counters.frames_received, 15U);
  event = {};
  event.number = 1;
  history.correct(event);
  EXPECT_EQ(event.number, 8U);
}

TEST(LineHistory, NumbersContinueThoseOfEarlierRuns) {
  LineHistory history;
  history.begin_after(1000);
  history.restart();
  line::LineState state;
  state.counters.events = 2;
  state.counters.frames_received = 5;
  history.correct(state);
  EXPECT_EQ(state.counters.events, 1002U) << "the number of the newest event";
  EXPECT_EQ(state.counters.frames_received, 5U);
  Event event{.number = 2};
  history.correct(event);
  EXPECT_EQ(event.number, 1002U);
  history.restart();
  event.number = 1;
  history.correct(event);
  EXPECT_EQ(event.number, 1003U);
}

}  // namespace
}  // namespace linegate::gateway
