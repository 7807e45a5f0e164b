// SPDX-License-Identifier: Apache-2.0
// Requests of lines to other gateways: which are sent, to whom, and what their answers mean. The
// head of peer_routes.h has the invariants.
#include "gateway/publish/peer_routes.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
using line::Refusal;
using routing::GatewayAnswer;
using routing::GatewayLine;
using routing::GatewayRequest;
using routing::GatewayWay;

const GatewayLine kPressOfB{"hall-b", "press"};
const GatewayLine kPackOfB{"hall-b", "pack"};

class FakePeerClient final : public PeerClient {
 public:
  struct Sent {
    GatewayLine to;
    std::uint64_t incarnation = 0;
    line::Request request;
    Duration timeout{};
  };
  void set_lines(const std::vector<GatewayLine>& /*addressed*/,
                 const std::vector<GatewayLine>& /*emcys*/) override {}
  std::uint64_t send(const GatewayLine& to, std::uint64_t incarnation, const line::Request& request,
                     Duration timeout) override {
    if (!has_room) {
      return 0;
    }
    sent.push_back({to, incarnation, request, timeout});
    return sent.size();
  }
  void cancel(std::uint64_t id) override { cancelled.push_back(id); }
  void poll(Duration /*timeout*/, PeerHandler& /*handler*/) override {}
  void wake() override {}

  std::vector<Sent> sent;
  std::vector<std::uint64_t> cancelled;
  bool has_room = true;
};

class PeerRoutesTest : public testing::Test, private PeerRoutes::Sink {
 protected:
  PeerRoutesTest() { routes_.set_lines({kPressOfB, kPackOfB}, now_); }

  void state(std::uint64_t incarnation, const GatewayLine& line = kPressOfB) {
    routes_.take_state(line, incarnation, ++state_time_, now_);
  }
  void pass(Duration time) {
    now_ += time;
    routes_.advance(now_);
  }
  // hall-b publishes its lines for some seconds.
  void run_for(int seconds, std::uint64_t incarnation = 1) {
    for (int i = 0; i < seconds; ++i) {
      state(incarnation);
      pass(1s);
    }
    state(incarnation);
  }
  GatewayRequest request(std::uint64_t number, bool write, const std::string& enter = {}) {
    return {.number = number,
            .way = std::make_shared<const GatewayWay>(GatewayWay{.to = kPressOfB, .enter = enter}),
            .deadline = now_ + 3s,
            .network = 7,
            .node = 5,
            .hops = 2,
            .address = {0x6040, 1},
            .write = write,
            .data = write ? std::vector(2, std::byte{9}) : std::vector<std::byte>{}};
  }
  void take(GatewayRequest of, const std::string& line = "hall") {
    routes_.take(client_, line, std::move(of), now_);
  }
  void reply(std::uint64_t id, Error error, std::vector<std::byte> data = {}) {
    routes_.take_answer(id, {.tag = id, .error = error, .data = std::move(data)});
  }
  // The only answer since the last call.
  std::optional<GatewayAnswer> answered() {
    EXPECT_LE(answers_.size(), 1U);
    if (answers_.empty()) {
      return std::nullopt;
    }
    GatewayAnswer out = std::move(answers_.front().second);
    answers_.clear();
    return out;
  }
  // How a write (or a read) that was sent ends with that result.
  GatewayAnswer end_of(bool write, Error error) {
    take(request(++numbers_, write));
    reply(client_.sent.size(), error);
    return answered().value_or(GatewayAnswer{});
  }

  bool answer(const std::string& line, GatewayAnswer& answer) override {
    if (has_room_) {
      answers_.emplace_back(line, std::move(answer));
    }
    return has_room_;
  }
  void set_present(const std::vector<GatewayLine>& present) override { present_ = present; }

  FakePeerClient client_;
  Instant now_{100s};
  std::int64_t state_time_ = 0;
  std::uint64_t numbers_ = 100;
  bool has_room_ = true;
  std::vector<std::pair<std::string, GatewayAnswer>> answers_;
  std::vector<GatewayLine> present_;
  PeerRoutes routes_{*this};
};

TEST_F(PeerRoutesTest, ARequestIsACommandToTheIncarnationThatPublishes) {
  run_for(1, 77);
  EXPECT_EQ(present_, std::vector{kPressOfB});
  take(request(1, false));
  ASSERT_EQ(client_.sent.size(), 1U);
  EXPECT_EQ(client_.sent[0].to, kPressOfB);
  EXPECT_EQ(client_.sent[0].incarnation, 77U);
  EXPECT_EQ(client_.sent[0].timeout, 3s);
  const auto& read = std::get<line::NetworkRead>(client_.sent[0].request);
  EXPECT_EQ(read.network, 7);
  EXPECT_EQ(read.node, 5);
  EXPECT_EQ(read.address, (od::Address{0x6040, 1}));
  EXPECT_EQ(read.hops, 2);
  EXPECT_FALSE(read.as_device);
  reply(1, {}, {std::byte{4}});
  const auto got = answered();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->number, 1U);
  EXPECT_EQ(got->abort, AbortCode::none);
  EXPECT_EQ(got->data, std::vector{std::byte{4}});
  reply(1, {}, {std::byte{5}});
  EXPECT_FALSE(answered()) << "it was answered";
}

TEST_F(PeerRoutesTest, ARequestWithoutRoomWasCertainlyNotCarriedOut) {
  run_for(1);
  client_.has_room = false;
  for (std::size_t i = 0; i < 2 * PeerRoutes::kMostUnderWay; ++i) {
    take(request(i, true));
    const auto got = answered();
    ASSERT_TRUE(got);
    EXPECT_EQ(got->number, i);
    EXPECT_EQ(got->abort, AbortCode::out_of_memory);
    EXPECT_FALSE(got->unknown);
  }
  client_.has_room = true;
  take(request(1'000, true));
  EXPECT_EQ(client_.sent.size(), 1U);
}

TEST_F(PeerRoutesTest, WithEnterItIsThatOfADeviceOfThatLine) {
  run_for(1);
  take(request(1, true, "pack"));
  EXPECT_EQ(answered()->abort, AbortCode::timeout) << "that line is not there";
  state(1, kPackOfB);
  take(request(2, true, "pack"));
  ASSERT_EQ(client_.sent.size(), 1U);
  EXPECT_EQ(client_.sent[0].to, kPackOfB);
  const auto& write = std::get<line::NetworkWrite>(client_.sent[0].request);
  EXPECT_TRUE(write.as_device);
  EXPECT_EQ(write.hops, 2);
  EXPECT_EQ(write.data, std::vector(2, std::byte{9}));
}

TEST_F(PeerRoutesTest, NothingIsSentToAGatewayThatIsSilent) {
  take(request(1, true));
  EXPECT_EQ(answered()->abort, AbortCode::timeout);
  state(1);
  pass(PeerRoutes::kSilence);
  EXPECT_TRUE(present_.empty());
  take(request(2, true));
  const auto got = answered();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->abort, AbortCode::timeout);
  EXPECT_FALSE(got->unknown) << "it was not sent";
  EXPECT_TRUE(client_.sent.empty());
}

TEST_F(PeerRoutesTest, ARepeatedStateIsNoSignOfLife) {
  routes_.take_state(kPressOfB, 1, 5, now_);
  pass(2s);
  routes_.take_state(kPressOfB, 1, 5, now_);
  pass(1s);
  EXPECT_TRUE(present_.empty());
}

TEST_F(PeerRoutesTest, ALineThatWasRemovedIsNotThere) {
  run_for(1);
  routes_.take_end(kPressOfB, now_);
  EXPECT_TRUE(present_.empty());
}

TEST_F(PeerRoutesTest, TwoGatewaysOfOneNameAreNone) {
  run_for(2, 1);
  state(2);
  EXPECT_EQ(present_, std::vector{kPressOfB}) << "the first one may have ended";
  pass(1500ms);
  state(1);
  EXPECT_TRUE(present_.empty());
  state(2);
  take(request(1, true));
  EXPECT_EQ(answered()->abort, AbortCode::timeout);
  EXPECT_TRUE(client_.sent.empty());
  pass(2s);
  state(2);
  pass(1s);
  state(2);
  EXPECT_EQ(present_, std::vector{kPressOfB}) << "one of them has ended";
}

TEST_F(PeerRoutesTest, AfterARestartTheNewOneIsAddressed) {
  run_for(2, 1);
  state(2);
  take(request(1, false));
  ASSERT_EQ(client_.sent.size(), 1U);
  EXPECT_EQ(client_.sent[0].incarnation, 2U);
}

TEST_F(PeerRoutesTest, ForeignPublishersDoNotFillTheMemory) {
  run_for(1, 1);
  for (std::uint64_t i = 10; i < 1000; ++i) {
    state(i);
  }
  pass(1500ms);
  state(1);
  EXPECT_TRUE(present_.empty()) << "they dispute it";
}

TEST_F(PeerRoutesTest, AnAbortIsThatOfTheOtherGateway) {
  run_for(1);
  for (const bool write : {false, true}) {
    const GatewayAnswer got = end_of(write, to_error(AbortCode::value_too_high));
    EXPECT_EQ(got.abort, AbortCode::value_too_high);
    EXPECT_FALSE(got.unknown);
  }
  EXPECT_EQ(end_of(true, {Domain::sdo, 0}).abort, AbortCode::general) << "an error without a code";
}

TEST_F(PeerRoutesTest, ARefusalIsAnAbortIfNothingWasCarriedOut) {
  run_for(1);
  const auto expect = [this](Refusal refusal, AbortCode abort) {
    for (const bool write : {false, true}) {
      const GatewayAnswer got = end_of(write, to_error(refusal));
      EXPECT_EQ(got.abort, abort) << describe(refusal);
      EXPECT_FALSE(got.unknown) << describe(refusal);
    }
  };
  expect(Refusal::busy, AbortCode::sdo_connection);
  expect(Refusal::not_permitted, AbortCode::local_control);
  expect(Refusal::no_right, AbortCode::local_control);
  expect(Refusal::line_down, AbortCode::device_state);
  expect(Refusal::wrong_state, AbortCode::device_state);
  expect(Refusal::image_pdo, AbortCode::device_state);
  expect(Refusal::bad_request, AbortCode::general);
  expect(Refusal::unknown_line, AbortCode::general);
  expect(Refusal::wrong_role, AbortCode::general);
}

// The other gateway had the request under way, or had it before it was started again.
TEST_F(PeerRoutesTest, AnyOtherEndOfAWriteIsUnknown) {
  run_for(1);
  for (const Refusal refusal : {Refusal::timed_out, Refusal::cancelled, Refusal::wrong_incarnation,
                                Refusal::no_acknowledge, Refusal::awaits_turn, Refusal{200}}) {
    const GatewayAnswer got = end_of(true, to_error(refusal));
    EXPECT_TRUE(got.unknown) << describe(refusal);
    EXPECT_EQ(got.abort, AbortCode::timeout);
  }
  EXPECT_TRUE(end_of(true, {Domain::can, 5}).unknown);
  EXPECT_TRUE(end_of(true, to_error(AbortCode::timeout)).unknown) << "the device did not answer";
}

TEST_F(PeerRoutesTest, RequestsThatEndAreCancelled) {
  run_for(1);
  take(request(1, true));
  take(request(1, true), "other");
  take({.number = 1, .cancelled = true});
  EXPECT_EQ(client_.cancelled, std::vector<std::uint64_t>{1});
  reply(1, {});
  EXPECT_FALSE(answered());
  reply(2, {});
  EXPECT_TRUE(answered());
  take({.number = 1, .cancelled = true});
  EXPECT_EQ(client_.cancelled.size(), 1U) << "it has ended";
}

TEST_F(PeerRoutesTest, ALineThatEndsTakesItsRequestsAlong) {
  run_for(1);
  take(request(1, true));
  has_room_ = false;
  take(request(2, true));
  reply(2, {});
  routes_.forget(client_, "hall");
  has_room_ = true;
  pass(10ms);
  EXPECT_FALSE(answered()) << "the line that has its name now has other requests";
  EXPECT_EQ(client_.cancelled, std::vector<std::uint64_t>{1});
  reply(1, {});
  EXPECT_FALSE(answered());
}

// A reload adds the first route with EMCYs.
TEST_F(PeerRoutesTest, RequestsOfAClientThatIsReplacedAreUnknownAtOnce) {
  run_for(1);
  take(request(1, true));
  take(request(2, false), "yard");
  routes_.end_requests(client_);
  EXPECT_EQ(client_.cancelled, (std::vector<std::uint64_t>{1, 2}));
  ASSERT_EQ(answers_.size(), 2U);
  EXPECT_EQ(answers_[0].first, "hall");
  EXPECT_EQ(answers_[0].second.number, 1U);
  EXPECT_EQ(answers_[1].first, "yard");
  for (const auto& [line, answer] : answers_) {
    EXPECT_EQ(answer.abort, AbortCode::timeout);
    EXPECT_TRUE(answer.unknown);
  }
  answers_.clear();
  reply(1, {});
  EXPECT_FALSE(answered()) << "one answer";
  routes_.set_lines({}, now_);
  EXPECT_EQ(routes_.publisher_of(kPressOfB, now_), std::nullopt) << "none is under way";
}

TEST_F(PeerRoutesTest, AnIncarnationThatNoGatewayHasIsIgnored) {
  run_for(1, 0);
  EXPECT_EQ(routes_.publisher_of(kPressOfB, now_), std::nullopt);
  take(request(1, true));
  EXPECT_TRUE(client_.sent.empty());
}

TEST_F(PeerRoutesTest, ExpiredRequestsAreNotSent) {
  run_for(1);
  GatewayRequest late = request(1, true);
  late.deadline = now_;
  take(std::move(late));
  EXPECT_TRUE(client_.sent.empty());
  EXPECT_FALSE(answered()->unknown);
}

TEST_F(PeerRoutesTest, OnlySoManyAreUnderWay) {
  run_for(1);
  for (std::uint64_t i = 1; i <= PeerRoutes::kMostUnderWay; ++i) {
    take(request(i, true));
  }
  take(request(500, true));
  EXPECT_EQ(answered()->abort, AbortCode::out_of_memory);
  EXPECT_EQ(client_.sent.size(), PeerRoutes::kMostUnderWay);
  reply(1, {});
  (void)answered();
  take(request(501, true));
  EXPECT_EQ(client_.sent.size(), PeerRoutes::kMostUnderWay + 1);
}

TEST_F(PeerRoutesTest, AnswersWaitForRoom) {
  run_for(1);
  has_room_ = false;
  take(request(1, true));
  reply(1, {});
  EXPECT_TRUE(routes_.is_waiting());
  pass(1ms);
  has_room_ = true;
  pass(1ms);
  EXPECT_FALSE(routes_.is_waiting());
  EXPECT_EQ(answered()->number, 1U);
}

TEST_F(PeerRoutesTest, OtherRoutesKeepWhatIsUnderWay) {
  run_for(1);
  take(request(1, true));
  routes_.set_lines({kPackOfB}, now_);
  reply(1, {});
  EXPECT_EQ(answered()->abort, AbortCode::none);
  routes_.set_lines({kPackOfB}, now_);
  state(1);
  EXPECT_TRUE(present_.empty()) << "no route leads over press any more";
}

}  // namespace
}  // namespace linegate::gateway
