// SPDX-License-Identifier: Apache-2.0
// Commands that arrive while the result of a scan is being applied. The line is about to be
// replaced, which would abort them. Also commands for the new line.
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/runtime/line_runner.h"

#include "tests/gateway/plans.h"
#include "tests/gateway/runtime/fake_channel.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

class HoldingLineTest : public testing::Test {
 protected:
  // Creates a line whose configuration results from a scan that found `scanned`.
  void make(std::vector<scan::ScannedNode> scanned) {
    config::LinePlan& plan = plant_.lines.at(0);
    plan.config.scanned = std::move(scanned);
    auto channel = std::make_unique<FakeChannel>();
    channel_ = channel.get();
    runner_ =
        std::make_unique<LineRunner>(make_line(plan), std::move(channel), plan, port_, consumer_);
  }
  void make_ready() {
    can::BusEvent ready;
    ready.kind = can::BusEvent::Kind::interface_ready;
    ready.time = now_;
    channel_->coming_events.push_back(ready);
    runner_->service(now_);
  }
  void serve(Duration later = 0ns) {
    now_ += later;
    runner_->called();
    runner_->service(now_);
  }
  void send_command(std::uint64_t tag, line::Request request) {
    line::Command command{.tag = tag, .request = std::move(request)};
    port_.commands.push(command);
  }
  void send_command(std::uint64_t tag, request::GatewayRequest request) {
    request::GatewayCommand command{.tag = tag, .request = std::move(request)};
    port_.interface_commands.push(command);
  }

  config::Plant plant_ = make_plant(
      "schema: 1\nlines: [{name: a, interface: 'virtual:a', access: all, sdo_timeout: 50ms}]\n");
  LinePort port_;
  exchange::Wakeup consumer_;
  FakeChannel* channel_ = nullptr;
  std::unique_ptr<LineRunner> runner_;
  Instant now_{1s};
};

// A scan of a bus without devices was applied.
class ScannedLineTest : public HoldingLineTest {
 protected:
  void SetUp() override {
    make({});
    make_ready();
    send_command(7, line::ScanApply{.node = 5});
    for (int i = 0; i < 20; ++i) {
      serve(10ms);
    }
    line::Reply reply;
    ASSERT_TRUE(port_.replies.pop(reply));
    ASSERT_EQ(reply.tag, 7U);
    ASSERT_TRUE(reply.ok());
  }
};

TEST_F(ScannedLineTest, CommandsWaitForWhatBecomesOfTheResult) {
  send_command(8, line::CanListen{});
  serve();
  serve(1s);
  line::Reply reply;
  EXPECT_FALSE(port_.replies.pop(reply));
  runner_->scan_kept();
  serve();
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 8U);
  EXPECT_TRUE(reply.ok());
}

TEST_F(ScannedLineTest, CommandsForTheInterfaceDoNotWait) {
  send_command(8, request::BusRestart{});
  serve();
  line::Reply reply;
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 8U);
  runner_->stop(now_);
  send_command(9, request::BusRestart{});
  serve();
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 9U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::cancelled));
}

TEST_F(ScannedLineTest, CommandsThatWaitAreAnsweredWhenItStops) {
  send_command(8, line::CanListen{});
  serve();
  runner_->stop(now_);
  serve();
  line::Reply reply;
  ASSERT_TRUE(port_.replies.pop(reply));
  EXPECT_EQ(reply.tag, 8U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::cancelled));
}

TEST_F(HoldingLineTest, AnInterfaceThatComesLateLetsCommandsWaitNoLongerThanTheDevicesNeed) {
  make({{.id = 5, .end = AbortCode::none, .values = {}}});
  serve();
  serve(1s);
  make_ready();
  send_command(8, line::CanListen{});
  serve();
  line::Reply reply;
  EXPECT_FALSE(port_.replies.pop(reply));
  now_ += ScanApplier::kSettle;
  ASSERT_LE(runner_->next_wake(), now_) << "it checks without being woken";
  runner_->service(now_);
  EXPECT_TRUE(port_.replies.pop(reply));
}

TEST_F(HoldingLineTest, ALineForWhichNobodyWaitsRests) {
  make({{.id = 5, .end = AbortCode::none, .values = {}}});
  serve();
  make_ready();
  now_ += ScanApplier::kSettle;
  runner_->service(now_);
  EXPECT_GT(runner_->next_wake(), now_);
}

}  // namespace
}  // namespace linegate::gateway
