// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/arbiter.h"

#include <algorithm>
#include <array>
#include <map>

#include "tests/stack/sdo/arbiter_fixture.h"

namespace linegate::sdo::test {
namespace {

TEST_F(ArbiterTest, ReadsAndWrites) {
  ASSERT_TRUE(submit(7));
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{kRead}));
  EXPECT_EQ(arbiter.next_wake(), now + kTimeout);
  answer();
  std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].number, 7U);
  EXPECT_EQ(done[0].node, 5);
  EXPECT_EQ(done[0].address, (od::Address{0x1018, 1}));
  EXPECT_FALSE(done[0].write);
  EXPECT_EQ(done[0].abort, AbortCode::none);
  EXPECT_EQ(numbers(done[0].data), (Bytes{1, 2, 3, 4}));

  ASSERT_TRUE(arbiter.submit({.owner = &client,
                              .number = 8,
                              .node = 5,
                              .address = {0x2000, 5},
                              .write = true,
                              .data = pattern(9)},
                             now));
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{{0x21, 0x00, 0x20, 5, 9, 0, 0, 0}}));
  answer(5, {0x60, 0x00, 0x20, 5, 0, 0, 0, 0});
  answer(5, {0x20, 0, 0, 0, 0, 0, 0, 0});
  answer(5, {0x30, 0, 0, 0, 0, 0, 0, 0});
  done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_TRUE(done[0].write);
  EXPECT_EQ(done[0].abort, AbortCode::none);
  EXPECT_EQ(arbiter.counters().transfers, 2U);
  EXPECT_EQ(arbiter.counters().aborts, 0U);
}

TEST_F(ArbiterTest, RegistersANodesIdentifiersWhenItIsFirstUsed) {
  EXPECT_EQ(dispatch.find(frame(0x585, {})), nullptr);
  submit(1);
  EXPECT_EQ(dispatch.find(frame(0x585, {}))->index, 5);
  EXPECT_EQ(dispatch.find(frame(0x605, {}))->index, Arbiter::kForeignRequest | 5);
  EXPECT_EQ(dispatch.find(frame(0x586, {})), nullptr);
}

TEST_F(ArbiterTest, OneTransferANodeAtATime) {
  submit(1);
  submit(2);
  EXPECT_EQ(arbiter.load(5), 2U);
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  answer();
  EXPECT_EQ(drain(queue, 0x605).size(), 1U);
  answer();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(arbiter.load(5), 0U);
}

// Neither transfer delays the other, nor the requests to a third node.
TEST_F(ArbiterTest, BlockTransfersTakeTurns) {
  for (const std::uint8_t node : Bytes{5, 6}) {
    ASSERT_TRUE(arbiter.submit({.owner = &client,
                                .number = node,
                                .node = node,
                                .address = {0x2100, 0},
                                .write = true,
                                .data = pattern(127 * 7),
                                .timeout = kTimeout},
                               now));
    EXPECT_EQ(drain(queue, 0x600U + node).at(0)[0], 0xC6);
  }
  answer(5, {0xA4, 0x00, 0x21, 0, 127, 0, 0, 0});
  answer(6, {0xA4, 0x00, 0x21, 0, 127, 0, 0, 0});
  std::map<std::uint32_t, unsigned> sent;
  for (int round = 0; round < 8; ++round) {
    EXPECT_LE(queue.queued(can::TransmitClass::sdo), Outbox::kMany);
    for (can::Frame next; queue.pop_rest(next);) {
      ++sent[next.id];
    }
    EXPECT_LE(sent[0x605], sent[0x606] + Outbox::kMany);
    EXPECT_LE(sent[0x606], sent[0x605] + Outbox::kMany);
    now += 1ms;
    arbiter.advance(now);
  }
  EXPECT_EQ(sent[0x605], 127U);
  EXPECT_EQ(sent[0x606], 127U);
}

class Discard : public od::ByteSink {
 public:
  AbortCode write(std::span<const std::byte> piece) override {
    size += piece.size();
    return AbortCode::none;
  }
  std::size_t size = 0;
};

TEST_F(ArbiterTest, StreamsAndOptionsReachTheTransfer) {
  Discard sink;
  ASSERT_TRUE(arbiter.submit({.owner = &client,
                              .number = 1,
                              .node = 5,
                              .address = {0x2100, 0},
                              .sink = &sink,
                              .timeout = kTimeout,
                              .options = {.transfer = Transfer::segmented, .repeats = 1}},
                             now));
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{{0x40, 0x00, 0x21, 0, 0, 0, 0, 0}}));
  answer(5, {0x41, 0x00, 0x21, 0, 200, 0, 0, 0});
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{{0x60, 0, 0, 0, 0, 0, 0, 0}}));
  answer(5, {0x01, 1, 2, 3, 4, 5, 6, 7});
  std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].abort, AbortCode::length_too_low);
  ASSERT_TRUE(arbiter.submit({.owner = &client,
                              .number = 2,
                              .node = 5,
                              .address = {0x2100, 0},
                              .sink = &sink,
                              .timeout = kTimeout},
                             now));
  drain(queue, 0x605);
  answer(5, {0x43, 0x00, 0x21, 0, 1, 2, 3, 4});
  done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].abort, AbortCode::none);
  EXPECT_TRUE(done[0].data.empty());
  EXPECT_EQ(sink.size, 4U);
}

TEST_F(ArbiterTest, NodesDoNotWaitForEachOther) {
  for (std::uint8_t node = 1; node <= 127; ++node) {
    ASSERT_TRUE(submit(node, Priority::boot, node));
  }
  can::Frame next;
  std::size_t sent = 0;
  while (queue.pop_rest(next)) {
    ++sent;
  }
  EXPECT_EQ(sent, 127U);
  for (std::uint8_t node = 127; node >= 1; --node) {
    answer(node);
  }
  EXPECT_EQ(completions().size(), 127U);
}

TEST_F(ArbiterTest, ThePrioritiesOfAQueue) {
  submit(1, Priority::background);
  submit(2, Priority::background);
  submit(3, Priority::routing);
  submit(4, Priority::boot);
  submit(5, Priority::command);
  for (int i = 0; i < 5; ++i) {
    serve();
  }
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 5, 4, 3, 2}));
}

TEST_F(ArbiterTest, ACommandBetweenTheStepsOfABoot) {
  submit(1, Priority::boot);
  submit(2, Priority::boot);
  submit(3, Priority::command);
  serve();
  serve();
  serve();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 3, 2}));
}

TEST_F(ArbiterTest, AFullQueueAndBadRequestsAreRefused) {
  for (std::uint64_t i = 0; i < 1 + Arbiter::kQueueLength; ++i) {
    ASSERT_TRUE(submit(i));
  }
  EXPECT_FALSE(submit(99));
  EXPECT_TRUE(submit(99, Priority::command, 6));
  EXPECT_FALSE(submit(100, Priority::command, 0));
  EXPECT_FALSE(submit(100, Priority::command, 128));
  EXPECT_FALSE(arbiter.submit({.owner = &client, .number = 100, .node = 7, .timeout = 0ns}, now));
  EXPECT_TRUE(completions().empty());
}

TEST_F(ArbiterTest, TimeOutThenTheNext) {
  submit(1);
  submit(2);
  drain(queue, 0x605);
  now += kTimeout;
  arbiter.advance(now - 1ns);
  EXPECT_TRUE(completions().empty());
  arbiter.advance(now);
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{abort_bytes(0x1018, 1, 0x0504'0000), kRead}));
  EXPECT_EQ(arbiter.next_wake(), now + kTimeout);
  const std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].abort, AbortCode::timeout);
  answer();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{2}));
  EXPECT_EQ(arbiter.counters().aborts, 1U);
  EXPECT_EQ(arbiter.counters().timeouts, 1U);
}

TEST_F(ArbiterTest, ALateAnswerIsAStrayAndNotForeign) {
  submit(1);
  arbiter.submit(
      {.owner = &client, .number = 2, .node = 5, .address = {0x1018, 2}, .timeout = kTimeout}, now);
  drain(queue, 0x605);
  now += kTimeout;
  arbiter.advance(now);
  answer();  // to 1018h sub 1
  EXPECT_EQ(arbiter.counters().strays, 1U);
  drain(queue, 0x605);
  answer(5, {0x43, 0x18, 0x10, 2, 9, 9, 9, 9});
  const std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 2U);
  EXPECT_EQ(numbers(done[1].data), (Bytes{9, 9, 9, 9}));
  EXPECT_EQ(arbiter.counters().foreign, 0U);
}

// See client_unanswered_test.cpp.
TEST_F(ArbiterTest, ARequestWaitsForTheAnswerToOneThatTimedOutOnItsWay) {
  RequestsUnderWay under_way;
  arbiter.follow(under_way);
  submit(1);
  submit(2);
  drain(queue, 0x605);
  under_way.handed_out(frame(0x605, kRead, now), 1);
  now += kTimeout;
  arbiter.advance(now);
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1}));
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{abort_bytes(0x1018, 1, 0x0504'0000)}));
  under_way.ended(1);
  now = arbiter.next_wake();
  arbiter.advance(now);
  answer();
  EXPECT_TRUE(ended().empty());
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{kRead}));
  EXPECT_LE(arbiter.next_wake(), now + kTimeout);
  answer();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{2}));
}

TEST_F(ArbiterTest, ALateAnswerWhenNothingFollows) {
  submit(1);
  now += kTimeout;
  arbiter.advance(now);
  drain(events);
  answer();
  EXPECT_EQ(arbiter.counters().strays, 1U);
  EXPECT_EQ(arbiter.counters().foreign, 0U);
  EXPECT_TRUE(events.empty());
}

TEST_F(ArbiterTest, AForeignRequestIsToldOnceUntilItIsQuiet) {
  submit(1);
  serve();
  for (int i = 0; i < 5; ++i) {
    now += 9s;
    receive(0x605, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0});
    answer(5, {0x43, 0x00, 0x10, 0, 1, 2, 3, 4});
  }
  std::vector<Event> told = drain(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(told[0].data, EventData(event::ForeignSdo{0x605}));
  EXPECT_EQ(arbiter.counters().foreign, 5U);
  EXPECT_EQ(arbiter.counters().strays, 5U);
  now += 10s;
  receive(0x605, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0});
  told = drain(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].time, now);
}

TEST_F(ArbiterTest, AnAnswerToNobodyIsForeignUse) {
  submit(1);
  serve();
  answer(5, {0x43, 0x00, 0x10, 0, 1, 2, 3, 4});
  const std::vector<Event> told = drain(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].data, EventData(event::ForeignSdo{0x585}));
  EXPECT_EQ(arbiter.counters().strays, 1U);
  EXPECT_EQ(arbiter.counters().foreign, 1U);
}

TEST_F(ArbiterTest, TheAnswerToAForeignRequestIsNotTakenForOurs) {
  submit(1);
  drain(queue, 0x605);
  receive(0x605, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0});
  answer(5, {0x43, 0x00, 0x10, 0, 9, 9, 9, 9});
  answer();
  const std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].abort, AbortCode::none);
  EXPECT_EQ(numbers(done[0].data), (Bytes{1, 2, 3, 4}));
}

TEST_F(ArbiterTest, AMalformedAnswerIsCountedAndTold) {
  submit(1);
  answer(5, {0x43, 0x18, 0x10});
  EXPECT_EQ(arbiter.counters().malformed, 1U);
  const std::vector<Event> told = drain(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(std::get<event::MalformedFrame>(told[0].data).identifier, 0x585U);
  EXPECT_EQ(std::get<event::MalformedFrame>(told[0].data).length, 3U);
  serve();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1}));
}

TEST_F(ArbiterTest, AbortsOfCommandsAreToldThoseOfBootAreNot) {
  submit(1, Priority::boot);
  serve(abort_bytes(0x1018, 1, 0x0602'0000));
  EXPECT_TRUE(events.empty());
  submit(2, Priority::command);
  serve(abort_bytes(0x1018, 1, 0x0602'0000));
  const std::vector<Event> told = drain(events);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].data,
            EventData(event::SdoAbort{.abort = AbortCode::no_object, .index = 0x1018, .sub = 1}));
}

TEST_F(ArbiterTest, CancelOfAWaitingRequest) {
  submit(1);
  submit(2);
  submit(3);
  drain(queue, 0x605);
  arbiter.cancel(client, 5, 2);
  const std::vector<Completion> done = completions();
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].number, 2U);
  EXPECT_EQ(done[0].abort, AbortCode::general);
  EXPECT_TRUE(queue.empty());
  serve();
  serve();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1, 3}));
}

TEST_F(ArbiterTest, CancelOfTheOneUnderWayTellsTheServer) {
  submit(1);
  submit(2);
  drain(queue, 0x605);
  arbiter.cancel(client, 5, 1);
  arbiter.cancel(client, 5, 77);
  arbiter.cancel(client, 6, 2);
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{abort_bytes(0x1018, 1, 0x0800'0000)}));
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{1}));
  EXPECT_LE(arbiter.next_wake(), now);
  now += 2s;
  arbiter.advance(now);
  EXPECT_EQ(drain(queue, 0x605), (std::vector<Bytes>{kRead}));
  EXPECT_EQ(arbiter.next_wake(), now + kTimeout);
  answer();
  EXPECT_EQ(ended(), (std::vector<std::uint64_t>{2}));
}

TEST_F(ArbiterTest, WithoutRoomInTheQueueNothingIsLost) {
  can::TransmitQueue small(2);
  can::Dispatch table;
  Arbiter crowded(table, small, events);
  Requester many(crowded);
  for (std::uint8_t node = 1; node <= 10; ++node) {
    ASSERT_TRUE(crowded.submit(
        {.owner = &many, .number = node, .node = node, .address = {0x1018, 1}, .timeout = kTimeout},
        now));
  }
  std::map<std::uint32_t, int> sent;
  can::Frame next;
  for (int i = 0; i < 10; ++i) {
    while (small.pop_rest(next)) {
      ++sent[next.id];
    }
    if (crowded.next_wake() > now + 10ms) {
      break;
    }
    now = crowded.next_wake();
    crowded.advance(now);
  }
  EXPECT_EQ(sent.size(), 10U);
  for (const auto& [id, count] : sent) {
    EXPECT_EQ(count, 1) << id;
  }
}

TEST_F(ArbiterTest, TwoAnswersToOneRequestAreThoseOfTwoDevices) {
  const auto shared = [this] {
    std::array<Event, 64> all;
    const std::size_t count = events.take(all);
    return std::ranges::count(std::span(all).first(count), EventKind::shared_node_id, &Event::kind);
  };
  ASSERT_TRUE(submit(1));
  serve();
  now += 1ms;
  answer(5, {0x43, 0x18, 0x10, 1, 1, 2, 3, 5});
  EXPECT_EQ(shared(), 1) << "another serial number";
  ASSERT_TRUE(submit(2));
  serve();
  answer(5, {0x43, 0x18, 0x10, 1, 1, 2, 3, 5});
  EXPECT_EQ(shared(), 0) << "reported recently";
}

TEST_F(ArbiterTest, AFrameThatIsRepeatedNowAndThenIsNoSecondDevice) {
  const auto shared = [this] {
    std::array<Event, 64> all;
    const std::size_t count = events.take(all);
    return std::ranges::count(std::span(all).first(count), EventKind::shared_node_id, &Event::kind);
  };
  const auto ask = [this](int answers) {
    now += 100ms;
    ASSERT_TRUE(submit(1));
    drain(queue, 0x605);
    for (int i = 0; i < answers; ++i) {
      answer();
    }
  };
  for (const int answers : {1, 2, 2, 1, 2, 2, 1}) {
    ask(answers);
  }
  EXPECT_EQ(shared(), 0);
  for (int i = 0; i < 6; ++i) {
    ask(2);
  }
  EXPECT_EQ(shared(), 1) << "six times in a row";
}

TEST_F(ArbiterTest, TheProducerTimeIsKnownOnceItWasConfirmedOrRead) {
  const auto time = [this] { return arbiter.producer_time(5); };
  const auto ask = [this](bool write, const Bytes& response) {
    Request request{
        .owner = &client, .number = 1, .node = 5, .address = {0x1017, 0}, .write = write};
    request.data =
        write ? std::vector<std::byte>{std::byte{0xFA}, std::byte{0}} : std::vector<std::byte>{};
    request.timeout = kTimeout;
    ASSERT_TRUE(arbiter.submit(std::move(request), now));
    serve(response);
  };
  EXPECT_EQ(time(), 0ms);
  ask(true, {0x60, 0x17, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(time(), 250ms);
  ask(true, abort_bytes(0x1017, 0, 0x0609'0030));
  EXPECT_EQ(time(), 0ms) << "the write was refused";
  ask(false, {0x4B, 0x17, 0x10, 0, 100, 0, 0, 0});
  EXPECT_EQ(time(), 100ms);
  receive(0x605, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  EXPECT_EQ(time(), 0ms) << "another client may have written it";
  ask(false, {0x4B, 0x17, 0x10, 0, 100, 0, 0, 0});
  arbiter.forget_producer_time(5);
  EXPECT_EQ(time(), 0ms);
}

TEST_F(ArbiterTest, AnswersToAnotherClientAreNoSecondDevice) {
  ASSERT_TRUE(submit(1));
  receive(0x605, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  answer();
  now += 1ms;
  answer(5, {0x43, 0x18, 0x10, 1, 1, 2, 3, 5});
  std::array<Event, 64> all;
  for (const Event& event : std::span(all).first(events.take(all))) {
    EXPECT_NE(event.kind(), EventKind::shared_node_id);
  }
}

TEST_F(ArbiterTest, SaveAndLoadHaveTimesOfTheirOwn) {
  arbiter.set_slow_writes(15s, 3s);
  const auto ends = [&](std::uint16_t index, bool write) {
    Request request{
        .owner = &client, .number = 1, .node = 5, .address = {index, 1}, .write = write};
    request.data.resize(4);
    request.timeout = kTimeout;
    const Instant begin = now;
    EXPECT_TRUE(arbiter.submit(std::move(request), now));
    do {
      now = std::max(now, arbiter.next_wake());
      arbiter.advance(now);
    } while (completions().empty());
    return now - begin;
  };
  EXPECT_EQ(ends(0x1010, true), 15s);
  EXPECT_EQ(ends(0x1011, true), 3s);
  EXPECT_EQ(ends(0x1012, true), kTimeout);
  EXPECT_EQ(ends(0x1010, false), kTimeout) << "a read does not store";
  arbiter.set_slow_writes(10ms, 10ms);
  EXPECT_EQ(ends(0x1010, true), kTimeout) << "never shorter than for any other object";
}

}  // namespace
}  // namespace linegate::sdo::test
