// SPDX-License-Identifier: Apache-2.0
// Requests to other gateways that a process of its own sends: both ends, without that process. The
// head of remote_peers.h has the invariants.
#include "gateway/publish/remote_peers.h"

#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/publish/peer_server.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
using line::Refusal;
using routing::GatewayLine;

const GatewayLine kPressOfPeer{"hall-b", "press"};
const GatewayLine kPackOfPeer{"hall-b", "pack"};

// The process: a number, and messages in both directions that end with it.
struct FakePeerProcess {
  std::uint64_t number = 1;
  bool has_room = true;
  std::deque<PeerMessage> to;
  std::deque<PeerMessage> from;
  std::vector<std::string> rejected;
  std::vector<std::string> replaced;
  Duration waited{};
  Duration finished{-1};

  void die() {
    number = 0;
    to.clear();
    from.clear();
  }
};

class FakePeerLink final : public PeerLink {
 public:
  explicit FakePeerLink(FakePeerProcess& process) : process_(process) {}
  std::uint64_t number() const override { return process_.number; }
  bool send(std::uint64_t number, PeerBytes message) override {
    if (number != process_.number || !process_.has_room) {
      return false;
    }
    process_.to.emplace_back(message.begin(), message.end());
    return true;
  }
  std::uint64_t receive(PeerMessage& message) override {
    if (process_.number == 0 || process_.from.empty()) {
      return 0;
    }
    message = std::move(process_.from.front());
    process_.from.pop_front();
    return process_.number;
  }
  void wait(Duration timeout) override { process_.waited = timeout; }
  void wake() override {}
  void reject(std::uint64_t /*number*/, std::string_view reason) override {
    process_.rejected.emplace_back(reason);
  }
  void replace(std::uint64_t /*number*/, std::string_view reason) override {
    process_.replaced.emplace_back(reason);
  }
  void finish(Duration limit) override { process_.finished = limit; }

 private:
  FakePeerProcess& process_;
};

// The client in the process.
class ClientInProcess final : public PeerClient {
 public:
  struct Sent {
    GatewayLine to;
    std::uint64_t incarnation = 0;
    line::Request request;
    Duration timeout{};
  };
  void set_lines(const std::vector<GatewayLine>& addressed,
                 const std::vector<GatewayLine>& emcys) override {
    lines_ = addressed;
    emcys_ = emcys;
  }
  std::uint64_t send(const GatewayLine& to, std::uint64_t incarnation, const line::Request& request,
                     Duration timeout) override {
    sent.push_back({to, incarnation, request, timeout});
    return 1'000 + sent.size();
  }
  void cancel(std::uint64_t id) override { cancelled.push_back(id); }
  void poll(Duration /*timeout*/, PeerHandler& handler) override {
    for (const auto& act : std::exchange(acts, {})) {
      act(handler);
    }
  }
  void wake() override {}

  std::vector<GatewayLine> lines_;
  std::vector<GatewayLine> emcys_;
  std::vector<Sent> sent;
  std::vector<std::uint64_t> cancelled;
  std::vector<std::function<void(PeerHandler&)>> acts;  // in the next poll
};

class RemotePeersTest : public testing::Test, public PeerHandler {
 protected:
  RemotePeersTest() { peers_.set_lines({kPressOfPeer, kPackOfPeer}, {}); }

  void poll() { peers_.poll(200ms, *this); }
  // The process carries out what it has received, and answers. Returns false if it ends.
  bool serve() {
    while (!process_.to.empty()) {
      const PeerMessage message = std::move(process_.to.front());
      process_.to.pop_front();
      if (kind_of(message) == static_cast<std::uint8_t>(ToPeers::configure)) {
        settings_ = decode_settings(message);
        client_ = {};
        server_ = std::make_unique<PeerServer>(client_, [this] { return now_; });
      } else if (!server_->handle(message)) {
        return false;
      }
    }
    server_->poll(0s, [this](PeerBytes message) {
      process_.from.emplace_back(message.begin(), message.end());
      return true;
    });
    return true;
  }
  void exchange() {
    poll();
    serve();
    poll();
  }
  void state_of(const GatewayLine& line, std::uint64_t incarnation = 7, std::int64_t time = 1) {
    exchange();
    client_.acts.emplace_back(
        [=](PeerHandler& handler) { handler.on_state(line, incarnation, time, 7); });
    exchange();
  }
  void reply_of(std::size_t index, line::Reply reply) {
    client_.acts.emplace_back([index, reply = std::move(reply)](PeerHandler& handler) {
      handler.on_answer(1'001 + index, reply);
    });
  }
  std::uint64_t write(std::uint8_t value = 9, Duration timeout = 3s) {
    return peers_.send(kPressOfPeer, 7,
                       line::NetworkWrite{.network = 7,
                                          .node = 5,
                                          .address = {0x6040, 1},
                                          .as_device = true,
                                          .data = {std::byte{value}},
                                          .hops = 2},
                       timeout);
  }
  // Process 1 ends; the next one has that number.
  void restart(std::uint64_t number) {
    process_.die();
    process_.number = number;
  }

  void on_state(const GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                std::uint16_t network) override {
    states_.push_back({line, incarnation, time, network});
  }
  void on_event(const GatewayLine& line, std::uint64_t incarnation,
                const PeerEvent& event) override {
    events_.push_back({line, incarnation, event});
  }
  void on_gone(const GatewayLine& line) override { gone_.push_back(line); }
  void on_answer(std::uint64_t id, const line::Reply& reply) override {
    answers_.emplace_back(id, reply);
  }
  using Answers = std::vector<std::pair<std::uint64_t, Error>>;
  Answers ends() {
    Answers out;
    for (const auto& [id, reply] : std::exchange(answers_, {})) {
      out.emplace_back(id, reply.error);
    }
    return out;
  }

  Instant now_{100s};
  FakePeerProcess process_;
  std::optional<PeerSettings> settings_;
  ClientInProcess client_;
  std::unique_ptr<PeerServer> server_;
  std::string renewal_;
  std::int64_t expiry_ = -1;
  int renewals_ = 0;
  RemotePeers peers_{std::make_unique<FakePeerLink>(process_),
                     {.gateway = "hall-a",
                      .domain = 7,
                      .interfaces = {"eth0", "eth1"},
                      .peers = {"host"},
                      .servers = {"server:1"},
                      .profile = "profile.xml",
                      .guard = false,
                      .secured = true,
                      .identity = "/identity"},
                     [this] { return now_; },
                     {.due =
                          [this](Instant, std::int64_t next_expiry) {
                            expiry_ = next_expiry;
                            return renewal_;
                          },
                      .done = [this](Instant) { ++renewals_; }}};
  std::vector<PeerState> states_;
  std::vector<PeerEventOf> events_;
  std::vector<GatewayLine> gone_;
  std::vector<std::pair<std::uint64_t, line::Reply>> answers_;
};

const Error kPeerTimedOut = line::to_error(Refusal::timed_out);

TEST_F(RemotePeersTest, TheProcessReceivesTheSettingsAndTheLines) {
  exchange();
  ASSERT_TRUE(settings_);
  EXPECT_EQ(settings_->gateway, "hall-a");
  EXPECT_EQ(settings_->domain, 7U);
  EXPECT_EQ(settings_->interfaces, (std::vector<std::string>{"eth0", "eth1"}));
  EXPECT_EQ(settings_->peers, std::vector<std::string>{"host"});
  EXPECT_EQ(settings_->servers, std::vector<std::string>{"server:1"});
  EXPECT_EQ(settings_->profile, "profile.xml");
  EXPECT_FALSE(settings_->guard);
  EXPECT_TRUE(settings_->secured);
  EXPECT_EQ(settings_->identity, "/identity");
  EXPECT_EQ(client_.lines_, (std::vector{kPressOfPeer, kPackOfPeer}));
  peers_.set_lines({kPackOfPeer}, {});
  exchange();
  EXPECT_EQ(client_.lines_, std::vector{kPackOfPeer});
  state_of(kPressOfPeer);
  EXPECT_TRUE(states_.empty()) << "nobody asked for it";
}

TEST_F(RemotePeersTest, StatesAndEndsOfLinesArePassedOn) {
  state_of(kPressOfPeer, 7, -5);
  ASSERT_EQ(states_.size(), 1U);
  EXPECT_EQ(states_[0].line, kPressOfPeer);
  EXPECT_EQ(states_[0].incarnation, 7U);
  EXPECT_EQ(states_[0].time, -5);
  EXPECT_EQ(states_[0].network, 7);
  client_.acts.emplace_back([](PeerHandler& handler) { handler.on_gone(kPressOfPeer); });
  client_.acts.emplace_back([](PeerHandler& handler) { handler.on_gone({"hall-c", "press"}); });
  exchange();
  EXPECT_EQ(gone_, std::vector{kPressOfPeer});
}

TEST_F(RemotePeersTest, EventsOfLinesWhoseEmcysAreWantedArePassedOn) {
  const GatewayLine other{"hall-c", "store"};
  peers_.set_lines({kPressOfPeer}, {other});
  exchange();
  EXPECT_EQ(client_.emcys_, std::vector{other});
  const PeerEvent emcy{.stream = 3,
                       .number = 1ULL << 60U,
                       .time = -9,
                       .node = 9,
                       .routed = true,
                       .emcy = routing::ForwardedEmcy{.code = 0x8130,
                                                      .error_register = 0x11,
                                                      .network = 300,
                                                      .node = 127,
                                                      .hops = 2,
                                                      .number = 200}};
  client_.acts.emplace_back([=](PeerHandler& handler) {
    handler.on_event(other, 7, emcy);
    handler.on_event(kPackOfPeer, 7, emcy);
    handler.on_event(other, 7, {.stream = 3, .number = 5});
  });
  exchange();
  ASSERT_EQ(events_.size(), 2U);
  EXPECT_EQ(events_[0].line, other);
  EXPECT_EQ(events_[0].incarnation, 7U);
  const PeerEvent& got = events_[0].event;
  EXPECT_EQ(got.stream, 3U);
  EXPECT_EQ(got.number, 1ULL << 60U);
  EXPECT_EQ(got.time, -9);
  EXPECT_EQ(got.node, 9);
  EXPECT_TRUE(got.routed);
  ASSERT_TRUE(got.emcy);
  EXPECT_TRUE(got.emcy->same(*emcy.emcy));
  EXPECT_EQ(got.emcy->hops, 2);
  EXPECT_FALSE(events_[1].event.emcy);
}

TEST_F(RemotePeersTest, ARequestIsSentOnceWithTheTimeThatIsLeft) {
  exchange();
  const std::uint64_t id = write();
  ASSERT_NE(id, 0U);
  now_ += 1s;  // in the memory of both
  serve();
  ASSERT_EQ(client_.sent.size(), 1U);
  EXPECT_EQ(client_.sent[0].to, kPressOfPeer);
  EXPECT_EQ(client_.sent[0].incarnation, 7U);
  EXPECT_EQ(client_.sent[0].timeout, 2s);
  const auto& request = std::get<line::NetworkWrite>(client_.sent[0].request);
  EXPECT_EQ(request.network, 7);
  EXPECT_EQ(request.node, 5);
  EXPECT_EQ(request.address, (od::Address{0x6040, 1}));
  EXPECT_TRUE(request.as_device);
  EXPECT_EQ(request.hops, 2);
  EXPECT_EQ(request.data, std::vector{std::byte{9}});
  reply_of(0, {.tag = 1'001});
  reply_of(0, {.tag = 1'001});
  exchange();
  EXPECT_EQ(ends(), (Answers{{id, Error{}}}));
}

TEST_F(RemotePeersTest, AReadReturnsItsValueAndALongOneIsNotTakenForAShorterOne) {
  exchange();
  const line::NetworkRead read{.network = 7, .node = 5, .address = {0x1018, 1}};
  const std::uint64_t id = peers_.send(kPackOfPeer, 7, read, 3s);
  peers_.send(kPackOfPeer, 7, read, 3s);
  serve();
  ASSERT_EQ(client_.sent.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<line::NetworkRead>(client_.sent[0].request));
  reply_of(0, {.tag = 1'001, .data = std::vector{std::byte{4}, std::byte{5}}});
  reply_of(1, {.tag = 1'002, .data = std::vector<std::byte>(1'000'000)});
  exchange();
  ASSERT_EQ(answers_.size(), 2U);
  EXPECT_EQ(answers_[0].first, id);
  EXPECT_EQ(answers_[0].second.bytes(), (std::vector{std::byte{4}, std::byte{5}}));
  EXPECT_EQ(answers_[1].second.bytes().size(), kLongestPeerValue);
}

TEST_F(RemotePeersTest, ARequestWhoseTimePassedOnItsWayIsNotSent) {
  exchange();
  const std::uint64_t id = write(9, 1s);
  now_ += 1s;
  serve();
  EXPECT_TRUE(client_.sent.empty());
  poll();
  EXPECT_EQ(ends(), (Answers{{id, kPeerTimedOut}}));
  poll();
  EXPECT_TRUE(answers_.empty()) << "one answer";
}

TEST_F(RemotePeersTest, ACancelledRequestIsNotAnswered) {
  exchange();
  const std::uint64_t id = write();
  serve();
  peers_.cancel(id);
  reply_of(0, {.tag = 1'001});
  exchange();
  EXPECT_EQ(client_.cancelled, (std::vector<std::uint64_t>{1'001}));
  EXPECT_TRUE(answers_.empty());
  peers_.cancel(id);
  peers_.cancel(77);
  EXPECT_TRUE(process_.to.empty());
}

// A process ends before, while and after it carries out a write: the next one never receives it.
TEST_F(RemotePeersTest, ARequestOfAProcessThatEndsIsUncertainAndIsNotSentAgain) {
  for (unsigned moment = 0; moment < 3; ++moment) {
    state_of(kPressOfPeer);
    gone_.clear();
    const std::uint64_t id = write();
    ASSERT_NE(id, 0U);
    if (moment >= 1) {
      serve();
      ASSERT_EQ(client_.sent.size(), 1U);
    }
    if (moment == 2) {
      reply_of(0, {.tag = 1'001});
      serve();
    }
    process_.die();
    EXPECT_EQ(write(), 0U) << "no process runs";
    poll();
    EXPECT_EQ(ends(), (Answers{{id, kPeerTimedOut}})) << moment;
    EXPECT_EQ(gone_, std::vector{kPressOfPeer});
    restart(2 + moment);
    exchange();
    EXPECT_TRUE(client_.sent.empty());
    EXPECT_EQ(client_.lines_, (std::vector{kPressOfPeer, kPackOfPeer}));
    EXPECT_TRUE(answers_.empty());
  }
}

// The next process runs before the gateway notices the end of the last one.
TEST_F(RemotePeersTest, ARequestNeverReachesAnotherProcessThanTheOneThatIsKnown) {
  state_of(kPressOfPeer);
  const std::uint64_t id = write();
  restart(2);
  EXPECT_EQ(write(), 0U);
  EXPECT_TRUE(process_.to.empty());
  poll();
  EXPECT_EQ(ends(), (Answers{{id, kPeerTimedOut}}));
  EXPECT_EQ(gone_, std::vector{kPressOfPeer});
  EXPECT_EQ(process_.to.size(), 2U) << "settings and lines";
}

TEST_F(RemotePeersTest, WithoutAnAnswerARequestEndsAtItsDeadline) {
  exchange();
  const std::uint64_t id = write(9, 150ms);
  poll();
  EXPECT_TRUE(answers_.empty());
  EXPECT_EQ(process_.waited, 150ms) << "not longer";
  now_ += 150ms;
  poll();
  EXPECT_EQ(ends(), (Answers{{id, kPeerTimedOut}}));
  serve();
  reply_of(0, {.tag = 1'001});
  exchange();
  EXPECT_TRUE(answers_.empty());
}

TEST_F(RemotePeersTest, WithoutRoomNothingIsSent) {
  exchange();
  process_.has_room = false;
  EXPECT_EQ(write(), 0U);
  peers_.set_lines({kPackOfPeer}, {});
  poll();
  process_.has_room = true;
  exchange();
  EXPECT_EQ(client_.lines_, std::vector{kPackOfPeer}) << "the lines follow when there is room";
  EXPECT_TRUE(client_.sent.empty());
  EXPECT_TRUE(answers_.empty());
}

TEST_F(RemotePeersTest, AProcessThatSendsNonsenseIsRejected) {
  const PeerMessage answer = encode(PeerAnswer{.id = 1, .error = kPeerTimedOut, .data = {}});
  std::vector<PeerMessage> nonsense{
      {},
      {std::byte{99}},
      encode_stop(),
      encode(PeerAnswer{.id = 0}),
      encode(PeerAnswer{.id = 1'000}),
      encode(PeerState{.line = {"", "press"}}),
      encode_gone({"hall-b", std::string(65, 'x')}),
  };
  for (const PeerMessage& whole : {answer, encode(PeerState{.line = kPressOfPeer}),
                                   encode_gone(kPressOfPeer), encode_expiry(5), encode_ready()}) {
    nonsense.push_back(whole);
    nonsense.back().push_back(std::byte{0});
    for (std::size_t length = 1; length < whole.size(); ++length) {
      nonsense.emplace_back(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    }
  }
  PeerMessage other_domain = answer;
  other_domain[9] = std::byte{4};
  nonsense.push_back(other_domain);
  exchange();
  write();
  for (std::size_t i = 0; i < nonsense.size(); ++i) {
    process_.rejected.clear();
    process_.from = {nonsense[i]};
    poll();
    EXPECT_EQ(process_.rejected.size(), 1U) << i;
    EXPECT_TRUE(answers_.empty()) << i;
  }
}

TEST_F(RemotePeersTest, AProcessThatSpeaksBeforeItHasItsSettingsIsRejected) {
  exchange();
  restart(2);
  process_.has_room = false;
  process_.from = {encode(PeerState{.line = kPressOfPeer})};
  poll();
  EXPECT_EQ(process_.rejected.size(), 1U);
  EXPECT_TRUE(states_.empty());
}

TEST_F(RemotePeersTest, TheProcessIsReplacedForItsIdentitiesWhenNoRequestIsUnderWay) {
  exchange();
  server_->report_expiry(1'234);
  exchange();
  EXPECT_EQ(expiry_, 1'234);
  write();
  serve();
  renewal_ = "revoked.crl has changed";
  exchange();
  EXPECT_TRUE(process_.replaced.empty());
  reply_of(0, {.tag = 1'001});
  exchange();
  EXPECT_EQ(process_.replaced, std::vector<std::string>{"revoked.crl has changed"});
  EXPECT_EQ(renewals_, 1);
  EXPECT_FALSE(serve()) << "it is asked to end";
}

TEST_F(RemotePeersTest, RequestsDoNotDelayTheReplacementForever) {
  exchange();
  write(9, 60s);
  serve();
  renewal_ = "revoked.crl has changed";
  poll();
  EXPECT_EQ(renewals_, 0);
  now_ += RemotePeers::kForRequests;
  poll();
  EXPECT_EQ(renewals_, 1);
}

// It runs on for a while, and carries out nothing.
TEST_F(RemotePeersTest, AProcessThatWasAskedToEndReceivesNoRequests) {
  exchange();
  renewal_ = "revoked.crl has changed";
  poll();
  ASSERT_EQ(renewals_, 1);
  const std::size_t messages = process_.to.size();
  EXPECT_EQ(write(), 0U) << "not sent, so its result is certain";
  EXPECT_EQ(process_.to.size(), messages);
  poll();
  EXPECT_EQ(renewals_, 1) << "it is asked once";
  renewal_.clear();
  restart(2);
  exchange();
  EXPECT_EQ(ends(), Answers{});
  EXPECT_NE(write(), 0U);
}

TEST_F(RemotePeersTest, ALineThatIsNoLongerWantedIsForgotten) {
  state_of(kPressOfPeer);
  peers_.set_lines({kPackOfPeer}, {});
  peers_.set_lines({kPressOfPeer, kPackOfPeer}, {});
  restart(2);
  poll();
  EXPECT_EQ(gone_, std::vector<GatewayLine>{}) << "it was not there since";
}

// The library does not try again to authenticate a participant.
TEST_F(RemotePeersTest, WithDdsSecurityTheProcessIsReplacedWhileALineIsAbsent) {
  const auto replacements_in = [&](Duration time) {
    process_.replaced.clear();
    for (const Instant end = now_ + time; now_ < end; now_ += 1s) {
      poll();
      if (!serve()) {
        restart(process_.number + 1);
      }
    }
    return process_.replaced;
  };
  state_of(kPressOfPeer);
  state_of(kPackOfPeer);
  EXPECT_EQ(replacements_in(10min), std::vector<std::string>{}) << "both are there";
  client_.acts.emplace_back([](PeerHandler& handler) { handler.on_gone(kPackOfPeer); });
  EXPECT_EQ(replacements_in(RemotePeers::kFirstAbsence - 5s), std::vector<std::string>{});
  EXPECT_EQ(replacements_in(10s),
            std::vector<std::string>{"hall-b/pack is not there, or was not authenticated"});
  state_of(kPressOfPeer);
  EXPECT_EQ(replacements_in(2 * RemotePeers::kFirstAbsence - 20s), std::vector<std::string>{});
  EXPECT_EQ(replacements_in(30s).size(), 1U);
  EXPECT_LE(replacements_in(24h).size(), 24h / RemotePeers::kLongestAbsence + 4);
  state_of(kPressOfPeer);
  state_of(kPackOfPeer);
  EXPECT_EQ(replacements_in(24h), std::vector<std::string>{});
}

// Each member of samples has its extreme values: the process is not replaced for them.
TEST_F(RemotePeersTest, NothingThatASampleContainsIsRefusedByTheGateway) {
  constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
  constexpr auto kLeastTime = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMostTime = std::numeric_limits<std::int64_t>::max();
  const routing::ForwardedEmcy least{};
  const routing::ForwardedEmcy most{.code = 0xFFFF,
                                    .error_register = 0xFF,
                                    .network = 0xFFFF,
                                    .node = 0xFF,
                                    .hops = 0xFF,
                                    .number = 0xFF};
  exchange();
  const std::uint64_t id = write();
  serve();
  client_.acts.emplace_back([&](PeerHandler& handler) {
    for (const GatewayLine& line :
         {kPressOfPeer, GatewayLine{}, GatewayLine{std::string(65, 'g'), std::string(65, 'l')}}) {
      for (const std::uint64_t number : {std::uint64_t{0}, kMost}) {
        for (const std::int64_t time : {kLeastTime, kMostTime}) {
          handler.on_state(line, number, time, static_cast<std::uint16_t>(number));
          for (const auto& emcy : {std::optional<routing::ForwardedEmcy>{}, {least}, {most}}) {
            for (const std::uint64_t stream : {std::uint64_t{0}, kMost}) {
              handler.on_event(line, number,
                               {.stream = stream,
                                .number = number,
                                .time = time,
                                .node = static_cast<std::uint8_t>(number),
                                .routed = number != 0,
                                .emcy = emcy});
            }
          }
        }
      }
      handler.on_gone(line);
    }
    handler.on_answer(1'001, {.tag = 1'001, .error = {static_cast<Domain>(0xFF), 0xFFFF'FFFF}});
  });
  exchange();
  EXPECT_EQ(process_.rejected, std::vector<std::string>{});
  EXPECT_EQ(states_.size(), 4U);
  EXPECT_EQ(events_.size(), 4U) << "without an EMCY, which has no valid node here";
  EXPECT_EQ(ends(), (Answers{{id, kPeerTimedOut}}));
}

TEST(PeerServer, EndsWithMalformedMessagesAndThoseOfTheStart) {
  ClientInProcess client;
  PeerServer server(client, [] { return Instant{100s}; });
  const PeerMessage send = encode(PeerSend{.id = 1,
                                           .to = kPressOfPeer,
                                           .incarnation = 7,
                                           .deadline = Instant{101s},
                                           .request = line::NetworkWrite{.data = {std::byte{1}}}});
  for (std::size_t length = 0; length < send.size(); ++length) {
    EXPECT_FALSE(server.handle(std::span(send).first(length))) << length;
  }
  EXPECT_TRUE(client.sent.empty());
  EXPECT_TRUE(server.handle(send));
  EXPECT_FALSE(server.handle(encode(PeerSettings{})));
  EXPECT_FALSE(server.handle(encode_stop()));
  EXPECT_FALSE(server.handle({}));
}

// States that nobody takes do not fill the memory; answers are never left out.
TEST(PeerServer, StatesAreLeftOutWhileThereIsNoRoom) {
  ClientInProcess client;
  PeerServer server(client, [] { return Instant{100s}; });
  ASSERT_TRUE(server.handle(encode(PeerLines{.addressed = {kPressOfPeer}})));
  ASSERT_TRUE(server.handle(encode(PeerSend{
      .id = 5, .to = kPressOfPeer, .deadline = Instant{101s}, .request = line::NetworkRead{}})));
  client.acts.emplace_back([](PeerHandler& handler) {
    for (int i = 0; i < 100'000; ++i) {
      handler.on_state(kPressOfPeer, 7, i, 7);
    }
    handler.on_answer(1'001, {.tag = 1'001});
  });
  EXPECT_FALSE(server.poll(0s, [](PeerBytes) { return false; }));
  std::size_t sent = 0;
  PeerMessage last;
  EXPECT_TRUE(server.poll(0s, [&](PeerBytes message) {
    ++sent;
    last.assign(message.begin(), message.end());
    return true;
  }));
  EXPECT_EQ(sent, PeerServer::kMostWaiting + 1);
  EXPECT_EQ(decode_answer(last)->id, 5U);
}

}  // namespace
}  // namespace linegate::gateway
