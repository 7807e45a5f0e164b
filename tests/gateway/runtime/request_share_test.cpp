// SPDX-License-Identifier: Apache-2.0
// Requests of clients through a runner: their share of the bus, and the events about them.
#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/runtime/line_runner_fixture.h"

namespace linegate::gateway {
namespace {

// NMT commands: more than the burst of a client on a bus of 1 Mbit/s.
constexpr std::uint64_t kFlood = 200;
constexpr std::uint32_t kFirstClient = 1;
constexpr std::uint32_t kSecondClient = 2;

constexpr const char* kWithOutputs = R"(schema: 1
lines:
  - name: a
    interface: virtual:a
    bit_rate: 125kbit
    access: {commands: all, outputs: all}
    nodes:
      - {id: 5, name: io, eds: bridges/sim/eds/digital-io.eds, check_identity: false}
)";

class RequestShareTest : public LineRunnerTest {
 protected:
  using LineRunnerTest::LineRunnerTest;

  void request(std::uint64_t tag, std::uint32_t client, line::Request what, bool audited = false) {
    line::Command command{.tag = tag, .request = std::move(what)};
    command.client = client;
    command.audited = audited;
    ASSERT_TRUE(port_.commands.push(command));
  }
  // The tags of the replies so far.
  std::vector<std::uint64_t> replied() {
    std::vector<std::uint64_t> out;
    for (line::Reply reply; port_.replies.pop(reply);) {
      out.push_back(reply.tag);
      last_ = reply;
    }
    return out;
  }
  std::vector<Event> of_kind(EventKind kind) {
    std::vector<Event> out = events();
    std::erase_if(out, [kind](const Event& event) { return event.kind() != kind; });
    return out;
  }

  line::Reply last_;
};

TEST_F(RequestShareTest, CommandsBeyondItWaitAndEachIsAnsweredOnce) {
  boot();
  for (std::uint64_t tag = 1; tag <= kFlood; ++tag) {
    request(tag, kFirstClient, line::NmtRequest{.node = 5});
  }
  serve();
  std::vector<std::uint64_t> answered = replied();
  EXPECT_GE(answered.size(), 1U);
  EXPECT_LT(answered.size(), kFlood / 2);
  request(1000, kSecondClient, line::NmtRequest{.node = 5});
  serve();
  EXPECT_EQ(replied(), std::vector<std::uint64_t>{1000}) << "another client does not wait";
  EXPECT_LE(runner_->next_wake(), now_ + 5ms) << "it wakes up without another input";
  for (int i = 0; i < 1000; ++i) {
    now_ = std::max(now_ + 1ms, runner_->next_wake());
    runner_->service(now_);
    const std::vector<std::uint64_t> more = replied();
    answered.insert(answered.end(), more.begin(), more.end());
    channel_->accepts = 1000;
  }
  EXPECT_EQ(answered.size(), kFlood);
  EXPECT_EQ(std::set(answered.begin(), answered.end()).size(), kFlood);
  const std::vector<Event> limited = of_kind(EventKind::client_limited);
  ASSERT_EQ(limited.size(), 1U);
  EXPECT_EQ(limited[0].get<event::ClientLimited>()->client, kFirstClient);
  EXPECT_GT(limited[0].get<event::ClientLimited>()->delayed, 0U);
}

TEST_F(RequestShareTest, CommandsThatWaitAreCancelledWhenTheLineStops) {
  boot();
  for (std::uint64_t tag = 1; tag <= kFlood; ++tag) {
    request(tag, kFirstClient, line::NmtRequest{.node = 5});
  }
  serve();
  const std::size_t before = replied().size();
  runner_->stop(now_);
  serve(1ms);
  EXPECT_EQ(before + replied().size(), kFlood);
  EXPECT_EQ(last_.error, line::to_error(line::Refusal::cancelled));
  EXPECT_TRUE(runner_->stopped(now_));
}

TEST_F(RequestShareTest, AFullQueueIsAnsweredAsBusy) {
  boot();
  std::size_t answered = 0;
  bool busy = false;
  for (std::uint64_t tag = 1; tag <= 1000; ++tag) {
    request(tag, kFirstClient, line::NmtRequest{.node = 5});
    if (tag % 100 == 0) {
      serve();
      for (line::Reply reply; port_.replies.pop(reply); ++answered) {
        busy |= reply.error == line::to_error(line::Refusal::busy);
      }
    }
  }
  EXPECT_TRUE(busy);
  EXPECT_GE(answered, 1000 - line::RequestBudget::kQueued);
}

TEST_F(RequestShareTest, AnSdoCommandWaitsForTheOneBeforeItAtItsNode) {
  boot();
  channel_->sent.clear();
  request(1, kFirstClient, kRead);
  request(2, kSecondClient, kRead);
  serve();
  ASSERT_EQ(channel_->sent.size(), 1U);
  come(0x585, {0x43, 0x00, 0x10, 0x00, 1, 2, 3, 4});
  runner_->service(now_);
  EXPECT_EQ(replied(), std::vector<std::uint64_t>{1});
  EXPECT_LE(runner_->next_wake(), now_);
  runner_->service(now_);
  EXPECT_EQ(channel_->sent.size(), 2U) << "the next one begins without another input";
}

// A sub-block of more frames than the burst of the client arrives after a pause. The account is
// filled for the pause before they are counted, not after.
TEST_F(RequestShareTest, APauseBeforeFramesOfATransferDoesNotPayForThem) {
  boot();
  request(1, kFirstClient, kRead);
  serve();
  come(0x585, {0x41, 0x00, 0x10, 0x00, 0x79, 0x03, 0, 0});  // 889 bytes: one sub-block
  serve(1ms);
  come(0x585, {0xC2, 0x00, 0x10, 0x00, 0x79, 0x03, 0, 0});
  serve(1ms);
  channel_->sent.clear();
  now_ += 40ms;
  for (std::uint8_t i = 1; i <= 127; ++i) {
    come(0x585, {static_cast<std::uint8_t>(i == 127 ? 0xFF : i), 0, 0, 0, 0, 0, 0, 0});
  }
  const Instant arrived = now_;
  while (channel_->sent.empty() && now_ < arrived + 1s) {
    serve(1ms);
  }
  // At 150 kbit/s, less the burst of 50 ms
  constexpr Duration kTimeOfTheFrames = 127 * Duration(122s) / 150'000;
  EXPECT_GE(now_ - arrived, kTimeOfTheFrames - 50ms);
  ASSERT_EQ(channel_->sent.size(), 1U);
  EXPECT_EQ(channel_->sent[0].data[0], std::byte{0xA2}) << "the acknowledgement";
}

TEST_F(RequestShareTest, AcceptedCommandsThatChangeSomethingAreEvents) {
  boot();
  (void)events();
  request(1, kFirstClient, line::NmtRequest{.node = 5}, true);
  request(2, kSecondClient, kRead);
  serve();
  std::vector<Event> accepted = of_kind(EventKind::command_accepted);
  ASSERT_EQ(accepted.size(), 1U);
  EXPECT_EQ(accepted[0].node, 5);
  EXPECT_EQ(accepted[0].data, EventData(event::CommandAccepted{.command = line::CommandKind::nmt,
                                                               .client = kFirstClient}));
  request(3, kSecondClient,
          line::SdoWrite{.node = 5, .address = {0x1017, 0}, .data = {std::byte{1}}}, true);
  serve();
  come(0x585, {0x43, 0x00, 0x10, 0x00, 1, 2, 3, 4});
  serve();
  serve();
  accepted = of_kind(EventKind::command_accepted);
  ASSERT_EQ(accepted.size(), 1U);
  EXPECT_EQ(
      accepted[0].data,
      EventData(event::CommandAccepted{
          .command = line::CommandKind::sdo_write, .index = 0x1017, .client = kSecondClient}));
  channel_->restart_gives = 0;
  request::GatewayCommand restart{
      .tag = 4, .client = kFirstClient, .audited = true, .request = request::BusRestart{}};
  port_.interface_commands.push(restart);
  serve();
  accepted = of_kind(EventKind::command_accepted);
  ASSERT_EQ(accepted.size(), 1U);
  EXPECT_EQ(accepted[0].data, EventData(event::CommandAccepted{
                                  .command = request::BusRestart::kKind, .client = kFirstClient}));
}

TEST_F(RequestShareTest, ARefusedCommandIsNotAccepted) {
  boot();
  (void)events();
  request(1, kFirstClient, line::SdoWrite{.node = 200, .data = {std::byte{1}}}, true);
  serve();
  const std::vector<Event> all = events();
  ASSERT_EQ(all.size(), 1U);
  const auto* const refused = all[0].get<event::CommandRefused>();
  ASSERT_NE(refused, nullptr);
  EXPECT_EQ(refused->client, kFirstClient);
}

class OutputShareTest : public RequestShareTest {
 protected:
  OutputShareTest() : RequestShareTest(kWithOutputs) {}

  void write(std::uint8_t value, std::uint32_t client = kFirstClient) {
    const image::Layout& layout = runner_->line().layout(image::Direction::outputs);
    line::OutputWrite out{.layout_id = layout.id, .arming = 1, .watchdog = 20ms};
    for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
      out.values.push_back({.entry = i, .length = 1, .data = {std::byte{value}}});
    }
    out.client_number = client;
    ASSERT_TRUE(port_.outputs.push(out));
  }
};

// 5,000 writes a second, for a second.
TEST_F(OutputShareTest, TheNewestOutputsAreSentAndTheWatchdogIsServed) {
  boot();
  channel_->sent.clear();
  (void)events();
  unsigned frames = 0;
  std::uint8_t last = 0;
  const auto look = [&] {
    for (const can::Frame& frame : std::exchange(channel_->sent, {})) {
      if (frame.id == 0x205) {
        ++frames;
        last = std::to_integer<std::uint8_t>(frame.data[0]);
      }
    }
    channel_->accepts = 1000;
  };
  for (int i = 0; i < 5000; ++i) {
    write(static_cast<std::uint8_t>(i));
    serve(200us);
    look();
  }
  constexpr double kShare = 125'000 * 0.15 * 1.05;  // bits, with the burst
  EXPECT_LE(frames, kShare / 122 + 1);
  EXPECT_GE(frames, kShare / 122 * 0.8);
  for (int i = 0; i < 10; ++i) {
    serve(1ms);
    look();
  }
  EXPECT_EQ(last, static_cast<std::uint8_t>(4999)) << "the newest values";
  EXPECT_TRUE(of_kind(EventKind::output_watchdog).empty());
  serve(20ms);
  EXPECT_EQ(of_kind(EventKind::output_watchdog).size(), 1U) << "the client is silent now";
}

// Three clients use up the share of the line with commands. Their watchdog would be served while
// outputs of a fourth client, which keeps within its share, wait for ever.
TEST_F(OutputShareTest, AFloodOfCommandsDoesNotHoldBackTheOutputsOfOthers) {
  boot();
  std::uint64_t tag = 0;
  for (int i = 0; i < 100; ++i) {
    for (std::uint32_t client = kFirstClient; client < kFirstClient + 3; ++client) {
      request(++tag, client, line::NmtRequest{.node = 5});
    }
    serve(1ms);
    (void)replied();
    channel_->accepts = 1000;
  }
  channel_->sent.clear();
  write(0x5A, kFirstClient + 3);
  bool sent = false;
  for (int i = 0; i < 100 && !sent; ++i) {
    for (std::uint32_t client = kFirstClient; client < kFirstClient + 3; ++client) {
      request(++tag, client, line::NmtRequest{.node = 5});
    }
    serve(1ms);
    (void)replied();
    channel_->accepts = 1000;
    sent = std::ranges::any_of(channel_->sent, [](const can::Frame& frame) {
      return frame.id == 0x205 && frame.data[0] == std::byte{0x5A};
    });
  }
  EXPECT_TRUE(sent);
}

}  // namespace
}  // namespace linegate::gateway
