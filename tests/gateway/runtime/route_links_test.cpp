// SPDX-License-Identifier: Apache-2.0
// Messages between routing lines, on one thread and between two threads.
#include "gateway/runtime/route_links.h"

#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>

#include "gateway/exchange/wakeup.h"
#include "stack/routing/message.h"

namespace linegate::gateway {
namespace {

using routing::Message;
using routing::MessageKind;

Message to(std::uint8_t interface, std::uint32_t connection,
           MessageKind kind = MessageKind::sdo_request) {
  return {.from = 1, .to = interface, .kind = kind, .connection = connection};
}

// The messages that a line has for other lines.
class Waiting {
 public:
  explicit Waiting(std::vector<Message> messages) : messages_(std::move(messages)) {}
  bool operator()(Message& out) {
    if (given_ == messages_.size()) {
      return false;
    }
    out = messages_[given_++];
    return true;
  }
  std::size_t given() const { return given_; }

 private:
  std::vector<Message> messages_;
  std::size_t given_ = 0;
};

const auto kNobody = [](const Message& message) {
  ADD_FAILURE() << "returned: " << message.connection;
};

TEST(RouteLinks, KeepTheOrderAndWakeWhoTakes) {
  exchange::Wakeup woken;
  RouteLink there(1, 2);
  there.taker = &woken;
  RouteEnd first;
  RouteEnd second;
  first.add_out(there);
  second.add_in(there);
  EXPECT_FALSE(second.arrived());
  Waiting line({to(2, 7), to(2, 8)});
  first.give(line, kNobody);
  EXPECT_TRUE(second.arrived());
  pollfd readable{woken.descriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, 0), 1);
  std::vector<std::uint32_t> taken;
  second.take([&](const Message& message) { taken.push_back(message.connection); });
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{7, 8}));
  EXPECT_FALSE(second.arrived());
}

TEST(RouteLinks, WhatFindsNoRoomIsHeldAndNothingIsLost) {
  RouteLink there(1, 2);
  RouteLink elsewhere(1, 3);
  RouteEnd first;
  RouteEnd second;
  first.add_out(there);
  first.add_out(elsewhere);
  second.add_in(there);
  std::vector<Message> messages;
  for (std::uint32_t i = 0; i < RouteLink::kPlaces + 2; ++i) {
    messages.push_back(to(2, i));
  }
  messages.push_back(to(3, 0));
  Waiting line(messages);
  first.give(line, kNobody);
  EXPECT_TRUE(first.held());
  EXPECT_EQ(line.given(), RouteLink::kPlaces + 1) << "further messages stay in the line";
  first.give(line, kNobody);
  EXPECT_EQ(first.stalls(), 2U);
  std::uint32_t taken = 0;
  const auto take = [&](const Message& message) { EXPECT_EQ(message.connection, taken++); };
  second.take(take);
  EXPECT_EQ(taken, RouteLink::kPlaces);
  first.give(line, kNobody);
  EXPECT_FALSE(first.held());
  EXPECT_FALSE(elsewhere.messages.empty());
  second.take(take);
  EXPECT_EQ(taken, RouteLink::kPlaces + 2);
  EXPECT_EQ(first.lost(), 0U);
}

TEST(RouteLinks, WhoAsksALineThatIsGoneGetsAnAbort) {
  RouteLink there(1, 2);
  RouteLink back(2, 1);
  RouteEnd first;
  first.add_out(there);
  first.add_in(back);
  back.messages.push(to(1, 5));
  std::vector<Message> returned;
  const auto bring_back = [&](const Message& message) { returned.push_back(message); };
  there.messages.push(to(2, 6, MessageKind::sdo_open));
  first.remove(2, bring_back);
  ASSERT_EQ(returned.size(), 1U) << "the removed line did not take the message";
  EXPECT_EQ(returned[0].connection, 6U);
  returned.clear();
  EXPECT_FALSE(first.arrived());
  Waiting line({to(2, 7, MessageKind::sdo_open), to(2, 8, MessageKind::sdo_close), to(9, 9)});
  first.give(line, bring_back);
  ASSERT_EQ(returned.size(), 2U);
  EXPECT_EQ(returned[0].kind, MessageKind::sdo_refused);
  EXPECT_EQ(returned[0].connection, 7U);
  EXPECT_EQ(returned[0].to, 1);
  EXPECT_EQ(routing::abort_of(returned[0]), AbortCode::device_state);
  EXPECT_EQ(returned[1].connection, 9U);
  EXPECT_EQ(first.lost(), 4U);
  EXPECT_TRUE(there.messages.empty());
}

// Each of two executors sends and receives until both have all messages. The links are full at
// times.
TEST(RouteLinks, TwoThreadsHandEachOtherEverything) {
  constexpr std::uint32_t kMany = 50'000;
  struct Side {
    exchange::Wakeup wakeup;
    RouteEnd end;
    std::uint32_t given = 0;
    std::uint32_t taken = 0;
    bool in_order = true;
  };
  Side sides[2];
  RouteLink there(1, 2);
  RouteLink back(2, 1);
  there.taker = &sides[1].wakeup;
  back.taker = &sides[0].wakeup;
  sides[0].end.add_out(there);
  sides[0].end.add_in(back);
  sides[1].end.add_out(back);
  sides[1].end.add_in(there);
  const auto run = [&](Side& side, std::uint8_t other) {
    const auto next = [&](Message& out) {
      if (side.given == kMany) {
        return false;
      }
      out = to(other, side.given++);
      return true;
    };
    while (side.taken < kMany || side.given < kMany || side.end.held()) {
      side.wakeup.clear();
      side.end.take([&](const Message& message) {
        side.in_order = side.in_order && message.connection == side.taken;
        ++side.taken;
      });
      side.end.give(next, kNobody);
      if (!side.end.held() && side.given == kMany && side.taken < kMany && !side.end.arrived()) {
        pollfd readable{side.wakeup.descriptor(), POLLIN, 0};
        poll(&readable, 1, 1000);
      }
    }
  };
  std::thread first([&] { run(sides[0], 2); });
  std::thread second([&] { run(sides[1], 1); });
  first.join();
  second.join();
  EXPECT_EQ(sides[0].taken, kMany);
  EXPECT_EQ(sides[1].taken, kMany);
  EXPECT_TRUE(sides[0].in_order && sides[1].in_order);
}

}  // namespace
}  // namespace linegate::gateway
