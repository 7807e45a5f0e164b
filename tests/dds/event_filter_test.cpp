// SPDX-License-Identifier: Apache-2.0
// Events for the routes of a gateway: only those of the participant that publishes the line.
#include "bridges/dds/event_filter.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using namespace std::chrono_literals;

WriterGuid state_writer_of(std::uint8_t participant) {
  return {1, 15, participant};
}

class EventFilterTest : public testing::Test {
 protected:
  void state(std::uint8_t participant, const std::string& line = "press") {
    publishers.note("plant", line, state_writer_of(participant), now);
  }
  void event(std::uint8_t participant, std::uint64_t number, const std::string& line = "press") {
    FollowedEvent of;
    of.source.gateway = "plant";
    of.source.line = line;
    of.event.number = number;
    filter.take(std::move(of), participant_of(state_writer_of(participant)), publishers, now,
                pass_on);
  }
  std::vector<std::uint64_t> passed_on() {
    filter.advance(publishers, now, pass_on);
    return std::exchange(numbers, {});
  }
  using Numbers = std::vector<std::uint64_t>;

  Instant now{10s};
  LinePublishers publishers;
  EventFilter filter;
  Numbers numbers;
  EventFilter::PassOn pass_on = [this](const FollowedEvent& event) {
    numbers.push_back(event.event.number);
  };
};

TEST_F(EventFilterTest, OnlyThePublisherOfTheLineIsPassedOn) {
  state(1);
  event(1, 10);
  event(2, 99);
  event(1, 11);
  EXPECT_EQ(passed_on(), (Numbers{10, 11}));
}

TEST_F(EventFilterTest, EventsWaitForTheFirstStateOfTheirLine) {
  event(2, 99);
  event(1, 10);
  EXPECT_EQ(passed_on(), Numbers{});
  state(1);
  event(1, 11);
  EXPECT_EQ(passed_on(), (Numbers{10, 11})) << "in their order";
}

TEST_F(EventFilterTest, NothingOfALineWithoutAPublisherIsPassedOn) {
  state(1, "");
  event(1, 10);
  state(1);
  publishers.lose(state_writer_of(1));
  event(1, 11);
  EXPECT_EQ(passed_on(), Numbers{});
  now += EventFilter::kPatience + 1ms;
  EXPECT_EQ(passed_on(), Numbers{});
  state(1);
  EXPECT_EQ(passed_on(), Numbers{}) << "they are too old";
}

TEST_F(EventFilterTest, ARestartedGatewayWaitsUntilItsFormerProcessIsSilent) {
  state(1);
  now += 500ms;
  state(2);
  event(2, 10);
  EXPECT_EQ(passed_on(), Numbers{});
  now += LinePublishers::kSilence - 500ms;
  EXPECT_EQ(passed_on(), Numbers{10});
}

TEST_F(EventFilterTest, TwoPublishersAreNotPassedOn) {
  state(1);
  state(2);
  state(1);
  event(1, 10);
  event(2, 10);
  publishers.lose(state_writer_of(2));
  EXPECT_EQ(passed_on(), Numbers{});
  event(1, 11);
  EXPECT_EQ(passed_on(), Numbers{11});
}

// DDS repeats up to 1000 events of each line for a late subscriber.
TEST_F(EventFilterTest, OfManyEventsTheLastOnesOfEachLineWait) {
  event(1, 5, "yard");
  for (std::uint64_t i = 1; i <= 1'000; ++i)
    event(1, i);
  state(1, "yard");
  EXPECT_EQ(passed_on(), Numbers{5}) << "another line needs no room of it";
  state(1);
  event(1, 1'001);
  const Numbers all = passed_on();
  ASSERT_EQ(all.size(), EventFilter::kMostOfLine);
  EXPECT_EQ(all.back(), 1'001U);
  for (std::size_t i = 1; i < all.size(); ++i)
    EXPECT_EQ(all[i], all[i - 1] + 1) << "no gap, which would look like a loss";
}

TEST_F(EventFilterTest, AFloodForUnknownLinesLeavesRoomForOthers) {
  for (std::uint64_t i = 0; i < 2 * EventFilter::kMostOfOne; ++i)
    event(2, i, "line" + std::to_string(i % 7));
  event(1, 10);
  state(1);
  EXPECT_EQ(passed_on(), Numbers{10});
  for (std::uint8_t line = 0; line < 7; ++line)
    state(2, "line" + std::to_string(line));
  EXPECT_EQ(passed_on().size(), EventFilter::kMostOfOne);
}

}  // namespace
}  // namespace linegate::dds
