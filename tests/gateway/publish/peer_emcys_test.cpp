// SPDX-License-Identifier: Apache-2.0
// EMCYs of networks of other gateways: which are passed on, and which count as lost. The head of
// peer_emcys.h has the invariants.
#include "gateway/publish/peer_emcys.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
using routing::ForwardedEmcy;
using routing::GatewayLine;

const GatewayLine kEmcyLine{"hall-b", "press"};
const GatewayLine kOtherLine{"hall-c", "store"};

class PeerEmcysTest : public testing::Test, private PeerEmcys::Sink {
 protected:
  PeerEmcysTest() { emcys_.set_lines({kEmcyLine}); }

  bool is_wanted(const GatewayLine& /*from*/, const ForwardedEmcy& emcy) const override {
    return emcy.network != kUnwanted;
  }
  void take_emcy(const GatewayLine& from, const ForwardedEmcy& emcy) override {
    (from == kEmcyLine ? passed_ : passed_of_other_).push_back(emcy);
  }
  void take_excess(const GatewayLine& from, const ForwardedEmcy& /*emcy*/) override {
    EXPECT_EQ(from, kEmcyLine);
    ++excess_;
  }
  void take_loss(const GatewayLine& from, std::uint16_t network, std::uint64_t count) override {
    EXPECT_EQ(from, kEmcyLine);
    lost_in_ = network;
    lost_ += count;
  }

  // The clock of hall-b is wrong by some days.
  std::int64_t remote(Instant time) const {
    return (time.time_since_epoch() - 77h + clock_step_).count();
  }
  void state() { emcys_.take_state(kEmcyLine, incarnation_, remote(now_), 7, now_); }
  // The number of each event is one more than the one before.
  void next_event(ForwardedEmcy emcy) {
    const bool routed = emcy.network != 0;
    event(++number_, now_, emcy, emcy.node, routed);
  }
  // An EMCY of kOtherLine, each time another one.
  void event_of_other(std::uint64_t number) {
    emcys_.take_state(kOtherLine, incarnation_, remote(now_), 8, now_);
    emcys_.take_event(kOtherLine, incarnation_,
                      {.stream = stream_,
                       .number = number,
                       .time = remote(now_),
                       .node = 9,
                       .emcy = own(static_cast<std::uint16_t>(number), 9)},
                      now_);
  }
  // It happened at that time, and is received now.
  void event(std::uint64_t number, Instant at, std::optional<ForwardedEmcy> emcy,
             std::uint8_t node = 5, bool routed = false) {
    emcys_.take_event(kEmcyLine, incarnation_,
                      {.stream = stream_,
                       .number = number,
                       .time = remote(at),
                       .node = node,
                       .routed = routed,
                       .emcy = emcy},
                      now_);
  }
  static ForwardedEmcy own(std::uint16_t code, std::uint8_t node = 5) {
    return {.code = code, .node = node};
  }
  void advance() {
    emcys_.advance([this](const GatewayLine&) { return publisher_; }, now_);
  }
  // The line lives, for that long.
  void run(Duration time) {
    for (const Instant end = now_ + time; now_ < end; now_ += 100ms) {
      if (now_ - state_at_ >= 1s) {
        state_at_ = now_;
        state();
      }
      advance();
    }
    advance();
  }
  std::vector<std::uint16_t> codes() {
    std::vector<std::uint16_t> out;
    for (const ForwardedEmcy& emcy : std::exchange(passed_, {})) {
      out.push_back(emcy.code);
    }
    return out;
  }
  std::uint64_t lost() { return std::exchange(lost_, 0); }
  std::size_t passed_of(std::uint8_t node) const {
    return static_cast<std::size_t>(std::ranges::count(passed_, node, &ForwardedEmcy::node));
  }
  using Codes = std::vector<std::uint16_t>;

  static constexpr std::uint16_t kUnwanted = 77;  // a network

  Instant now_{1'000s};
  Instant state_at_{};
  std::uint64_t incarnation_ = 7;
  std::uint64_t stream_ = 70;
  std::optional<std::uint64_t> publisher_ = 7;
  Duration clock_step_{};
  PeerEmcys emcys_{*this};
  std::uint64_t number_ = 0;
  std::vector<ForwardedEmcy> passed_;
  std::vector<ForwardedEmcy> passed_of_other_;
  std::uint64_t excess_ = 0;
  std::uint64_t lost_ = 0;
  std::uint16_t lost_in_ = 0;
};

TEST_F(PeerEmcysTest, AnEmcyIsPassedOnOnceAsThatOfItsDevice) {
  run(5s);
  event(10, now_, own(0x8130, 9));
  EXPECT_EQ(emcys_.next_wake(now_), now_ + PeerEmcys::kForRouted);
  run(1s);
  ASSERT_EQ(passed_.size(), 1U);
  EXPECT_EQ(passed_[0].network, 7);
  EXPECT_EQ(passed_[0].node, 9);
  EXPECT_EQ(passed_[0].hops, 1);
  EXPECT_EQ(codes(), Codes{0x8130});
  EXPECT_EQ(emcys_.next_wake(now_), kNever);
  event(10, now_, own(0x8130, 9));  // repeated for a late subscriber
  event(9, now_, own(0x8131));
  run(1s);
  EXPECT_EQ(codes(), Codes{});
  EXPECT_EQ(lost(), 0U);
}

TEST_F(PeerEmcysTest, AnEventThatIsLeftOutCountsAsALoss) {
  run(1s);
  event(10, now_, own(1));
  event(11, now_, std::nullopt);
  event(15, now_, own(2));
  run(1s);
  EXPECT_EQ(codes(), (Codes{1, 2}));
  EXPECT_EQ(lost(), 3U);
  EXPECT_EQ(lost_in_, 7);
}

// A cut network, or a process that was killed: afterwards DDS repeats the last events.
TEST_F(PeerEmcysTest, AnOldEmcyIsNotPassedOnAfterAReconnection) {
  run(5s);
  event(10, now_, own(1));
  run(1s);
  EXPECT_EQ(codes(), Codes{1});
  const Instant cut = now_;
  now_ += 10s;
  event(11, cut + 3s, own(2));
  event(12, now_ - 1500ms, own(3));
  advance();
  now_ += 100ms;
  advance();
  EXPECT_EQ(codes(), Codes{3}) << "without a new state, by the last one";
  EXPECT_EQ(lost(), 1U);
  run(2s);
  event(13, now_ - 2500ms, own(4));
  event(14, now_ - 1s, own(5));
  run(1s);
  EXPECT_EQ(codes(), Codes{5});
  EXPECT_EQ(lost(), 1U);
}

TEST_F(PeerEmcysTest, WhatWasBeforeTheLineWasFollowedIsNoLoss) {
  event(3, now_ - 1h, own(1));
  event(4, now_ - 10s, own(2));
  event(5, now_ - 500ms, own(3));
  run(3s);
  EXPECT_EQ(codes(), Codes{3});
  EXPECT_EQ(lost(), 0U);
}

// DDS repeats up to 1000 events of each line for a late subscriber.
TEST_F(PeerEmcysTest, ManyEventsOfBeforeTheLineWasFollowedAreNoLoss) {
  const auto repeat_old = [&](std::uint64_t first) {
    for (std::uint64_t i = 0; i < 1'000; ++i) {
      event(first + i, now_ - 1h, own(1));
    }
  };
  repeat_old(1);
  state();
  run(3s);
  EXPECT_EQ(lost(), 0U) << "before its first state";
  incarnation_ = stream_ = 8;
  state();
  repeat_old(1);
  publisher_.reset();
  run(3s);
  EXPECT_EQ(lost(), 0U) << "while two gateways publish it";
  incarnation_ = stream_ = 9;
  publisher_ = 9;
  state();
  repeat_old(1);
  event(1'001, now_, own(2));
  run(3s);
  EXPECT_EQ(codes(), Codes{2});
  EXPECT_EQ(lost(), 0U) << "after its first state";
}

TEST_F(PeerEmcysTest, AnotherWriterOfTheLineDoesNotMakeEventsSeen) {
  constexpr auto kLast = std::numeric_limits<std::uint64_t>::max();
  run(5s);
  event(10, now_, own(1));
  run(1s);
  EXPECT_EQ(codes(), Codes{1});
  incarnation_ = 666;
  event(kLast, now_, own(99));  // without a state
  incarnation_ = 7;
  event(11, now_, own(2));
  run(3s);
  EXPECT_EQ(codes(), Codes{2});
  lost();
  incarnation_ = 666;
  state();
  event(1, now_, own(99));
  event(kLast, now_, own(99));
  EXPECT_EQ(lost(), PeerEmcys::kMostLostAtOnce);
  incarnation_ = 7;
  now_ += 100ms;
  state();
  event(12, now_, own(3));
  run(1s);
  EXPECT_EQ(codes(), Codes{3});
}

TEST_F(PeerEmcysTest, AnEventWithoutANumberIsNoPartOfTheSequence) {
  run(1s);
  event(0, now_, own(1));
  event(1'000, now_, own(2));
  event(0, now_, own(3));
  event(1'001, now_, own(4));
  run(1s);
  EXPECT_EQ(codes(), (Codes{2, 4}));
  EXPECT_EQ(lost(), 0U);
}

TEST_F(PeerEmcysTest, AnEmcyOfTheFutureIsNotPassedOn) {
  run(5s);
  event(10, now_ + 1500ms, own(1));
  event(11, now_ + 4s, own(2));
  run(100ms);
  EXPECT_EQ(codes(), Codes{1});
  EXPECT_EQ(lost(), 1U);
}

TEST_F(PeerEmcysTest, AnyTimesOfSamplesAreAccepted) {
  constexpr auto kFirst = std::numeric_limits<std::int64_t>::min();
  constexpr auto kLast = std::numeric_limits<std::int64_t>::max();
  std::uint64_t number = 0;
  for (const std::int64_t of_state : {kFirst, kLast}) {
    emcys_.take_state(kEmcyLine, 7, of_state, 7, now_);
    for (const std::int64_t of_event : {kFirst, kLast}) {
      emcys_.take_event(
          kEmcyLine, 7,
          {.stream = 70, .number = ++number, .time = of_event, .node = 5, .emcy = own(1)}, now_);
      now_ += 100ms;
      advance();
      EXPECT_EQ(passed_.size(), of_state == of_event ? 1U : 0U);
      passed_.clear();
    }
  }
}

// A state of before a silence, which DDS repeats, makes nothing younger.
TEST_F(PeerEmcysTest, ARepeatedStateDoesNotMakeAnEmcyYounger) {
  run(5s);
  const std::int64_t last = remote(now_);
  emcys_.take_state(kEmcyLine, incarnation_, last, 7, now_);
  const Instant at = now_;
  now_ += 10s;
  emcys_.take_state(kEmcyLine, incarnation_, last, 7, now_);
  event(10, at, own(1));
  now_ += 100ms;
  advance();
  EXPECT_EQ(codes(), Codes{});
  EXPECT_EQ(lost(), 1U);
}

TEST_F(PeerEmcysTest, AStepOfTheOtherClockIsOverWithTheNextState) {
  run(5s);
  clock_step_ = 1h;
  run(2s);
  event(10, now_, own(1));
  run(1s);
  EXPECT_EQ(codes(), Codes{1});
  clock_step_ = -1h;
  run(2s);
  event(11, now_, own(2));
  run(1s);
  EXPECT_EQ(codes(), Codes{2});
  EXPECT_EQ(lost(), 0U);
}

TEST_F(PeerEmcysTest, NothingIsPassedOnWhileTwoGatewaysPublishTheLine) {
  run(5s);
  publisher_.reset();
  event(10, now_, own(1));
  run(1s);
  EXPECT_GT(emcys_.next_wake(now_), now_) << "not again and again";
  publisher_ = 7;
  run(100ms);
  EXPECT_EQ(codes(), Codes{1}) << "it is not too old yet";
  publisher_.reset();
  event(11, now_, own(2));
  run(3s);
  publisher_ = 7;
  run(1s);
  EXPECT_EQ(codes(), Codes{});
  EXPECT_EQ(lost(), 1U);
}

// An event may be received before the first state of its incarnation.
TEST_F(PeerEmcysTest, ARestartedGatewayNumbersAnew) {
  run(5s);
  event(1'000, now_, own(1));
  run(1s);
  incarnation_ = 8;
  stream_ = 80;
  event(1, now_, own(2));
  advance();
  now_ += 100ms;
  advance();
  publisher_ = 8;
  run(1s);
  event(2, now_, own(3));
  run(1s);
  EXPECT_EQ(codes(), (Codes{1, 2, 3}));
  EXPECT_EQ(lost(), 0U);
}

// A gateway on that bus: the event of its frame is followed by that of the source.
TEST_F(PeerEmcysTest, AForwardedEmcyIsThatOfItsSourceWithOneMoreHop) {
  run(5s);
  event(10, now_, own(0x1000, 9), 9);
  event(11, now_, own(0x2000, 9), 9);
  event(12, now_, ForwardedEmcy{.code = 0x1000, .network = 12, .node = 3, .hops = 2, .number = 44},
        9, true);
  run(1s);
  ASSERT_EQ(passed_.size(), 2U);
  EXPECT_EQ(passed_[0].code, 0x2000);
  EXPECT_EQ(passed_[0].network, 7);
  EXPECT_EQ(passed_[1].code, 0x1000);
  EXPECT_EQ(passed_[1].network, 12);
  EXPECT_EQ(passed_[1].node, 3);
  EXPECT_EQ(passed_[1].hops, 3);
  EXPECT_EQ(passed_[1].number, 44);
}

TEST_F(PeerEmcysTest, AFloodIsHeldWithinBounds) {
  publisher_.reset();
  run(5s);
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    event(i + 1, now_, own(static_cast<std::uint16_t>(i)));
  }
  publisher_ = 7;
  run(1s);
  EXPECT_EQ(passed_.size(), PeerEmcyLimit::kNodeBurst);
  EXPECT_EQ(passed_.front().code, 10'000 - PeerEmcys::kMostHeld);
  EXPECT_EQ(lost(), 10'000 - PeerEmcys::kMostHeld);
  EXPECT_EQ(excess_, PeerEmcys::kMostHeld - PeerEmcyLimit::kNodeBurst);
}

// Its supply fails.
TEST_F(PeerEmcysTest, AnEmcyOfEachNodeOfALinePassesAtOnce) {
  run(5s);
  for (std::uint8_t node = 1; node <= 127; ++node) {
    next_event(own(0x3100, node));
  }
  run(1s);
  EXPECT_EQ(passed_.size(), 127U);
  EXPECT_EQ(excess_, 0U);
}

TEST_F(PeerEmcysTest, AFloodOfANodeDoesNotDelayThoseOfOthers) {
  run(5s);
  constexpr unsigned kSeconds = 5;
  for (unsigned i = 0; i < 10 * kSeconds; ++i) {
    for (unsigned k = 0; k < 500; ++k) {
      next_event(own(static_cast<std::uint16_t>(0x1000 + k), 5));
    }
    if (i % 10 == 0) {
      next_event(own(static_cast<std::uint16_t>(0x8000 + i), 6));
    }
    for (unsigned k = 0; k < 500; ++k) {
      next_event(own(static_cast<std::uint16_t>(0x1000 + k), 5));
    }
    run(100ms);
  }
  run(1s);
  EXPECT_EQ(passed_of(6), kSeconds);
  EXPECT_GE(passed_of(5), PeerEmcyLimit::kNodePerSecond * (kSeconds - 1));
  EXPECT_LE(passed_of(5), PeerEmcyLimit::kNodeBurst + PeerEmcyLimit::kNodePerSecond * kSeconds);
  EXPECT_EQ(passed_.size() + excess_ + lost(), 10'000U * kSeconds + kSeconds);
}

// Of every source that it can name.
TEST_F(PeerEmcysTest, AFloodOfALineDoesNotDelayThoseOfOtherLines) {
  emcys_.set_lines({kEmcyLine, kOtherLine});
  run(5s);
  constexpr unsigned kSeconds = 20;
  std::uint64_t of_other = 0;
  for (unsigned i = 0; i < 10 * kSeconds; ++i) {
    for (unsigned k = 0; k < 200; ++k) {
      const unsigned source = 200 * i + k;
      next_event({.code = 0x1000,
                  .network = static_cast<std::uint16_t>(100 + source / 127 % 1'000),
                  .node = static_cast<std::uint8_t>(1 + source % 127)});
    }
    if (i % 10 == 0) {
      event_of_other(++of_other);
    }
    run(100ms);
  }
  run(1s);
  EXPECT_LE(passed_.size(), PeerEmcyLimit::kLineBurst + PeerEmcyLimit::kLinePerSecond * kSeconds);
  EXPECT_GT(excess_, 0U);
  EXPECT_EQ(passed_of_other_.size(), kSeconds);
}

TEST_F(PeerEmcysTest, NetworksThatNoLineSendsUseUpNothing) {
  run(5s);
  for (unsigned i = 0; i < 200; ++i) {
    next_event(
        {.code = 0x1000, .network = kUnwanted, .node = static_cast<std::uint8_t>(1 + i % 127)});
  }
  next_event(own(0x2000, 6));
  run(1s);
  EXPECT_EQ(codes(), Codes{0x2000});
  EXPECT_EQ(excess_ + lost(), 0U);
}

TEST(PeerEmcyLimit, PermitsAgainAfterAWhile) {
  PeerEmcyLimit limit;
  Instant now{1'000s};
  const auto admitted = [&](std::uint8_t node, unsigned of) {
    unsigned out = 0;
    for (unsigned i = 0; i < of; ++i) {
      out += limit.admit(0, 7, node, now) ? 1U : 0U;
    }
    return out;
  };
  EXPECT_EQ(admitted(5, 100), PeerEmcyLimit::kNodeBurst);
  EXPECT_EQ(admitted(5, 100), 0U);
  now += 1s;
  EXPECT_EQ(admitted(5, 100), PeerEmcyLimit::kNodePerSecond);
  now += 1min;
  EXPECT_EQ(admitted(5, 100), PeerEmcyLimit::kNodeBurst);
}

TEST(PeerEmcyLimit, AGatewayThatInventsSourcesLeavesTheRestToOthers) {
  PeerEmcyLimit limit;
  Instant now{1'000s};
  unsigned of_others = 0;
  for (unsigned i = 0; i < 1'000; ++i) {
    for (unsigned k = 0; k < 20; ++k) {
      (void)limit.admit(9, static_cast<std::uint16_t>(20 * i + k), 1, now);
    }
    if (i % 50 == 0) {
      of_others += limit.admit(0, 7, 5, now) ? 1U : 0U;
    }
    now += 10ms;
  }
  EXPECT_EQ(of_others, 20U);
}

TEST(PeerEmcyLimit, LinesShareTheSumOfAll) {
  constexpr unsigned kLines = 16;
  std::vector<PeerEmcyLimit> limits(kLines);
  Instant now{1'000s};
  unsigned admitted = 0;
  const auto flood = [&] {
    for (PeerEmcyLimit& limit : limits) {
      for (unsigned i = 0; i < 1'000; ++i) {
        admitted += limit.admit(0, 7, static_cast<std::uint8_t>(1 + i % 127), now) ? 1U : 0U;
      }
    }
  };
  for (PeerEmcyLimit& limit : limits) {
    limit.share_among(kLines);
  }
  flood();
  EXPECT_EQ(admitted, PeerEmcyLimit::kAllBurst);
  now += 2s;
  flood();
  EXPECT_EQ(admitted, PeerEmcyLimit::kAllBurst + 2 * PeerEmcyLimit::kAllPerSecond);
}

TEST(PeerEmcyLimit, RemembersFewSources) {
  PeerEmcyLimit limit;
  Instant now{1'000s};
  std::size_t most = 0;
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    (void)limit.admit(0, static_cast<std::uint16_t>(i), static_cast<std::uint8_t>(1 + i % 127),
                      now);
    most = std::max(most, limit.sources());
    now += 1ms;
  }
  EXPECT_LE(most, PeerEmcyLimit::kLineBurst + 5 * PeerEmcyLimit::kLinePerSecond);
}

TEST_F(PeerEmcysTest, OtherLinesAreIgnored) {
  run(1s);
  emcys_.set_lines({});
  event(10, now_, own(1));
  run(1s);
  EXPECT_EQ(codes(), Codes{});
}

}  // namespace
}  // namespace linegate::gateway
