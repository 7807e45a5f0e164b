// SPDX-License-Identifier: Apache-2.0
// The events that are printed, and their order.
#include "bridges/console/events.h"

#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "bridges/console/tables.h"

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint64_t kKeptByEach = 1'200;  // more than a Model keeps of both lines

// Two lines whose kept events are received one after the other, some with each poll. Event n of
// press has the time 2 n seconds, and event n of hall 2 n + 1 seconds.
class TwoHistories : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    for (const LineId& id : {test::kPress, test::kHall}) {
      LineView view = test::line_view(id == test::kPress ? 3 : 4);
      view.state.counters.events = kKeptByEach;
      listener.on_line(id, view);
    }
    for (int i = 0; i < 100 && sent < 2 * kKeptByEach; ++i, ++sent) {
      const bool press = sent < kKeptByEach;
      const std::uint64_t number = sent % kKeptByEach + 1;
      EventView event = test::event(number % 3 == 0 ? EventKind::emcy : EventKind::boot_up, number,
                                    5, std::to_string(number));
      event.time = Instant(std::chrono::seconds(2 * number + (press ? 0 : 1)));
      listener.on_event(press ? test::kPress : test::kHall, event);
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return {};
  }

  std::uint64_t sent = 0;
};

class EventsTest : public test::CommandTest<TwoHistories> {
 protected:
  EventsTest() {
    context_.wait = std::chrono::minutes(10);
    context_.utc = true;
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> out;
    std::istringstream in(out_.str());
    for (std::string line; std::getline(in, line);) {
      out.push_back(line);
    }
    return out;
  }
  static bool never() { return false; }
};

TEST_F(EventsTest, ACountGivesTheNewestInTheirOrder) {
  EXPECT_EQ(events(context_, {.count = 3}, never), kDone) << err_.str();
  EXPECT_THAT(lines(), ElementsAre("1970-01-01T00:39:59.000Z hall #1199 boot-up: 1199",
                                   "1970-01-01T00:40:00.000Z press #1200 emcy: 1200",
                                   "1970-01-01T00:40:01.000Z hall #1200 emcy: 1200"));
}

TEST_F(EventsTest, AllThatAreKeptAreInOrderHoweverManyThereAre) {
  EXPECT_EQ(events(context_, {.once = true}, never), kDone) << err_.str();
  const std::vector<std::string> all = lines();
  EXPECT_EQ(all.size(), 2 * kKeptByEach);
  EXPECT_TRUE(std::ranges::is_sorted(all));
}

TEST_F(EventsTest, AreThoseOfALineSinceATimeAndOfASeverity) {
  EXPECT_EQ(
      events(
          context_,
          {.line = "press", .once = true, .since = "1970-01-01 00:39:51Z", .severity = "warning"},
          never),
      kDone);
  EXPECT_THAT(lines(), ElementsAre("1970-01-01T00:39:54.000Z press #1197 emcy: 1197",
                                   "1970-01-01T00:40:00.000Z press #1200 emcy: 1200"));
  EXPECT_EQ(events(context_, {.since = "tomorrow"}, never), kUsage);
  EXPECT_EQ(events(context_, {.severity = "bad"}, never), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("'tomorrow' is no time"));
  EXPECT_THAT(err_.str(), HasSubstr("severities are info, warning and error"));
}

TEST_F(EventsTest, ThatAreNotReceivedAreMissed) {
  context_.wait = std::chrono::milliseconds(0);
  EXPECT_EQ(events(context_, {.once = true}, never), kIncomplete);
  EXPECT_THAT(err_.str(), HasSubstr("not all events that are kept were received"));
}

TEST(Since, IsAnAgeOrADate) {
  const Instant now{std::chrono::hours(100)};
  EXPECT_EQ(parse_since("90s", now), now - std::chrono::seconds(90));
  EXPECT_EQ(parse_since("10min", now), now - std::chrono::minutes(10));
  EXPECT_EQ(parse_since("3d", now), now - std::chrono::hours(72));
  EXPECT_EQ(parse_since("1970-01-02T03:04Z", now),
            Instant(std::chrono::hours(27) + std::chrono::minutes(4)));
  EXPECT_TRUE(parse_since("2024-02-29", now).has_value());
  EXPECT_EQ(
      parse_since("1970-01-02 03:04:05.32Z", now),
      Instant(std::chrono::hours(27) + std::chrono::minutes(4) + std::chrono::milliseconds(5320)));
  EXPECT_EQ(parse_since("1970-01-01 00:00:00.000000001Z", now), Instant(Duration(1)));
  for (const char* text :
       {"1970-01-02 03:04.5Z", "1970-01-02.5Z", "1970-01-02 03:04:05.Z", "1970-01-02 03:04:05.-1Z",
        "1970-01-02 03:04:05.1234567890Z", "1970-01-02 03:04:05.1.2Z", ".5"}) {
    EXPECT_EQ(parse_since(text, now), std::nullopt) << text;
  }
  for (const char* text : {"", "10", "-1s", "10m", "1h5", "1970-13-01", "1970-01-02 03:04+1",
                           "2026-02-30", "2026-02-29Z", "2026-04-31 12:00"}) {
    EXPECT_EQ(parse_since(text, now), std::nullopt) << text;
  }
}

// In Berlin the clocks were put forward on 1996-03-31, so that this day has 23 hours.
TEST(Since, IsTheBeginOfALocalDay) {
  ASSERT_EQ(::setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3", 1), 0);
  ::tzset();
  const Instant now = *parse_since("1996-04-01 15:30", {});
  EXPECT_EQ(parse_since("today", now), parse_since("1996-04-01", now));
  EXPECT_EQ(parse_since("yesterday", now), parse_since("1996-03-31", now));
  EXPECT_EQ(*parse_since("today", now) - *parse_since("yesterday", now), std::chrono::hours(23));
  const Instant first_of_march = *parse_since("1996-03-01 00:00", {});
  EXPECT_EQ(parse_since("yesterday", first_of_march), parse_since("1996-02-29", now));
  ASSERT_EQ(::unsetenv("TZ"), 0);
  ::tzset();
}

TEST(LocalText, HasTheDateAndTheTimeZoneOfThePlace) {
  ASSERT_EQ(::setenv("TZ", "EET-2", 1), 0);
  ::tzset();
  EXPECT_EQ(local_text(Instant(std::chrono::milliseconds(1))), "1970-01-01 02:00:00.001");
  EXPECT_EQ(parse_since("1970-01-01 03:00", {}), Instant(std::chrono::hours(1)));
  ASSERT_EQ(::unsetenv("TZ"), 0);
  ::tzset();
  EXPECT_EQ(local_text(Instant{}), "-");
}

}  // namespace
}  // namespace linegate::console
