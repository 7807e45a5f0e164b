// SPDX-License-Identifier: Apache-2.0
// An application that follows events has each once, in order, whatever the network loses and
// however often the application starts again where it left off.
#include "bridges/client/event_following.h"

#include <random>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/request/journal.h"

#include "fake_link.h"
#include "tests/plant/environment.h"

namespace linegate::client {
namespace {

using namespace std::chrono_literals;

struct FollowedEvents : testing::Test {
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  std::unique_ptr<Client> client = std::make_unique<Client>(fake_client(world));
  std::uint64_t newest = 0;
  std::uint64_t stored = 0;  // the journal has the events up to this one
  bool has_journal = true;
  std::uint64_t stream = 7;  // one for each start of a gateway without a journal
  std::uint64_t incarnation = 1;
  std::size_t answered = 0;
  std::vector<std::uint64_t> seen;
  std::uint64_t missed = 0;
  unsigned lost = 0;
  EventReader reader;

  void follow(const std::optional<std::string>& after) {
    reader = client->follow_events(after, [this](const Event& event) {
      EXPECT_EQ(event.line, "press");
      seen.push_back(event.number);
      missed += event.missed;
      lost += event.journal_lost ? 1U : 0U;
    });
    ASSERT_TRUE(reader);
  }
  // The application ends, and begins again with the position that it stored.
  void restart() {
    const std::string position = reader.position();
    reader = {};
    world->samples.clear();
    client = std::make_unique<Client>(fake_client(world));
    answered = world->requests.size();
    follow(position);
    states();
  }
  void states() {
    world->samples.emplace_back([this](dds::ClientListener& to) {
      dds::GatewayInfo info;
      info.event_stream = stream;
      to.on_gateway({.gateway = "gw", .incarnation = incarnation}, info);
    });
    line::LineState state;
    state.counters.events = newest;
    world->samples.emplace_back([this, state](dds::ClientListener& to) {
      to.on_line({.gateway = "gw", .line = "press", .incarnation = incarnation}, {}, state, {});
    });
  }
  void sample(std::uint64_t number) {
    world->samples.emplace_back([this, number](dds::ClientListener& to) {
      dds::ReceivedEvent event;
      event.stream = stream;
      event.number = number;
      to.on_event({.gateway = "gw", .line = "press", .incarnation = incarnation}, event, "", {});
    });
  }
  void publish(bool reaches = true) {
    ++newest;
    if (reaches)
      sample(newest);
  }
  // Answers requests as the journal, and polls.
  void run(linegate::Duration time) {
    for (const Instant end = world->now + time; world->now < end;) {
      for (; answered < world->requests.size(); ++answered)
        answer(answered + 1, world->requests[answered]);
      client->poll(20ms);
    }
  }
  void answer(std::uint64_t id, const std::pair<dds::Target, request::Request>& request) {
    const auto* const kinds = std::get_if<request::GatewayRequest>(&request.second);
    const auto* const read = kinds == nullptr ? nullptr : std::get_if<request::JournalRead>(kinds);
    ASSERT_NE(read, nullptr);
    EXPECT_EQ(request.first.gateway, "gw");
    request::JournalPage page;
    std::uint64_t next = 1 + (read->after ? read->after->number : 0);
    if (read->cursor.position != 0)
      next = read->cursor.position;
    for (; request.first.line == "press" && next <= stored && page.records.size() < 5; ++next)
      page.records.push_back({.stream = stream, .line = "press", .number = next, .text = "x"});
    page.more = request.first.line == "press" && next <= stored;
    page.cursor = {next, 1};
    dds::CommandResult result;
    result.id = id;
    result.reply.data = encode(page);
    if (!has_journal) {
      const auto why = std::as_bytes(std::span(request::kNoJournal));
      result.reply = {.error = line::to_error(line::Refusal::wrong_state),
                      .data = std::vector(why.begin(), why.end())};
    }
    world->samples.emplace_back([result](dds::ClientListener& to) { to.on_reply({}, result); });
  }
};

TEST_F(FollowedEvents, FromNowBeginsAfterTheStates) {
  newest = stored = 3;
  sample(2);  // a late joiner receives them again
  sample(3);
  follow(std::nullopt);
  states();
  run(100ms);
  EXPECT_EQ(seen, std::vector<std::uint64_t>{});
  EXPECT_EQ(reader.position(), "7:0:gw/ 7:3:gw/press");
  publish();
  publish(false);
  publish();
  stored = newest;
  run(2s);
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{4, 5, 6}));
  EXPECT_EQ(missed, 0U);
}

TEST_F(FollowedEvents, FromNowBeginsAtOnceWhereTheStatesAreKnown) {
  states();
  publish();
  client->poll(0ms);
  follow(std::nullopt);
  EXPECT_EQ(reader.position(), "7:0:gw/ 7:1:gw/press");
  publish();
  client->poll(0ms);
  EXPECT_EQ(seen, std::vector<std::uint64_t>{2});
}

TEST_F(FollowedEvents, OldestAreReadFromTheJournal) {
  newest = stored = 12;
  follow("");
  states();
  run(2s);
  EXPECT_EQ(seen.size(), 12U);
  EXPECT_EQ(reader.position(), "7:12:gw/press");
}

TEST_F(FollowedEvents, AnApplicationThatWasAwayGoesOn) {
  newest = stored = 3;
  follow("7:1:gw/press");
  states();
  run(1s);
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{2, 3}));
  publish(false);
  publish(false);
  stored = newest;
  restart();
  run(1s);
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{2, 3, 4, 5}));
}

TEST_F(FollowedEvents, WithoutAJournalTheGapIsReportedWithTheNextEvent) {
  follow(std::nullopt);
  states();
  run(100ms);
  publish(false);
  publish(false);
  publish();
  run(60s);
  EXPECT_EQ(seen, std::vector<std::uint64_t>{3});
  EXPECT_EQ(missed, 2U);
  EXPECT_EQ(reader.position(), "7:0:gw/ 7:3:gw/press");
}

TEST_F(FollowedEvents, WithoutAJournalNoEventIsHeldBack) {
  has_journal = false;
  follow("");
  states();
  run(20s);
  publish();
  run(100ms);
  EXPECT_EQ(seen, std::vector<std::uint64_t>{1});
  ++stream;  // the gateway starts again
  ++incarnation;
  newest = 0;
  states();
  publish();
  run(100ms);
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{1, 1}));
  EXPECT_EQ(lost, 1U);
  publish(false);
  publish();
  run(100ms);
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{1, 1, 3}));
  EXPECT_EQ(missed, 1U);
}

TEST_F(FollowedEvents, APositionIncludesTheEventThatIsPassedOn) {
  std::vector<std::string> positions;
  EventReader other = client->follow_events(
      std::nullopt, [&](const Event&) { positions.push_back(other.position()); });
  states();
  client->poll(0ms);
  publish();
  publish();
  client->poll(0ms);
  EXPECT_EQ(positions, (std::vector<std::string>{"7:0:gw/ 7:1:gw/press", "7:0:gw/ 7:2:gw/press"}));
}

TEST_F(FollowedEvents, WhatIsNoPositionIsRefused) {
  for (const char* text :
       {"x", "7", "7:1", "7:1:gw", "7:1:g w/press", "7:-1:gw/press", "7:1:gw/a/b", "7:1:gw/%4",
        "7:1:gw/%zz", "18446744073709551616:1:gw/press", " "}) {
    EXPECT_FALSE(client->follow_events(text, [](const Event&) {})) << text;
  }
  const auto known = EventFollowing::parse("7:1:g%20%2F%FF/press");
  ASSERT_TRUE(known);
  EXPECT_EQ(known->begin()->first.first, "g /\xFF");
  EXPECT_EQ(EventFollowing(known).position(), "7:1:g%20%2F%FF/press");
}

// Samples are lost, late and repeated, the journal stores late, and the application ends at any
// moment.
TEST_F(FollowedEvents, EachEventOnceInOrderOverRestarts) {
  const auto [first, count] = plant::seeds_of_run(1, 100);
  for (unsigned long seed = first; seed < first + count; ++seed) {
    std::minstd_rand random(static_cast<unsigned>(seed));
    const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
    newest = stored = 0;
    seen.clear();
    world->requests.clear();
    world->sent = 0;
    answered = 0;
    world->samples.clear();
    client = std::make_unique<Client>(fake_client(world));
    follow("");
    states();
    for (int step = 0; step < 150; ++step) {
      publish(!chance(30));
      if (chance(10))
        sample(1 + random() % newest);
      if (chance(20))
        stored = newest;
      if (chance(20))
        states();
      if (chance(5))
        restart();
      run(std::chrono::milliseconds(random() % 100));
    }
    stored = newest;
    states();
    run(70s);
    ASSERT_EQ(seen.size(), newest) << "seed " << seed;
    for (std::uint64_t i = 0; i < newest; ++i)
      ASSERT_EQ(seen[i], i + 1) << "seed " << seed;
    EXPECT_EQ(missed, 0U) << "seed " << seed;
  }
}

}  // namespace
}  // namespace linegate::client
