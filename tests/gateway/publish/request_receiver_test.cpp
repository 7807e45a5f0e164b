// SPDX-License-Identifier: Apache-2.0
// Reports of the request receiver about rejected requests, for any number of requests and any
// names.
#include "gateway/publish/request_receiver.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/log_keeper.h"
#include "tests/gateway/publish/fake_edge.h"

namespace linegate::gateway {
namespace {

class RequestReceiverTest : public testing::Test {
 protected:
  RequestReceiverTest() {
    config::LinePlan plan;
    plan.config.name = "press";
    hosts.push_back(std::make_unique<LineHost>(plan, image::Layout{}, image::Layout{}));
    hosts[0]->executor = &executor;
    receiver = std::make_unique<RequestReceiver>(edge, hosts, refusals, publisher, "");
    spdlog::default_logger()->set_level(spdlog::level::debug);
  }

  bool was_logged(const std::string& text) { return std::ranges::count(log.lines(), text) == 1; }

  FakeEdge edge;
  LogKeeper log;
  Executor executor{config::ExecutorPlan{}};
  exchange::Ring<line::Reply> refusals{4};
  exchange::Wakeup publisher;
  std::vector<std::unique_ptr<LineHost>> hosts;
  std::unique_ptr<RequestReceiver> receiver;
};

TEST_F(RequestReceiverTest, NamesOfStrangersDoNotSteerTheLog) {
  receiver->on_command_refused("pre\nss", "\x1b[2Jme", 1, line::Refusal::bad_request, "why");
  EXPECT_TRUE(was_logged("debug pre.ss: command of .[2Jme refused: why"));
  receiver->on_output_refused("pre\x1bss", 1, line::OutputRefusal::not_permitted, "why");
  EXPECT_TRUE(was_logged("debug pre.ss: outputs of group 1 refused: why"));
}

// Each request has another group, so that no reason equals the previous one.
TEST_F(RequestReceiverTest, WhatALineIsToldOfStrangersIsBoundedAndTheRestCounted) {
  constexpr unsigned kMany = 200;
  for (unsigned group = 0; group < kMany; ++group) {
    receiver->on_output_refused("press", static_cast<std::uint16_t>(group),
                                line::OutputRefusal::not_permitted, "why");
  }
  unsigned reported = 0;
  for (Event event; hosts[0]->port.notices.pop(event); ++reported) {
    EXPECT_EQ(std::get<event::OutputRefused>(event.data).group, reported)
        << "the first rejections are reported";
  }
  // If the machine stalls for a second, it may report more than the limit of one second.
  EXPECT_GE(reported, NoticeLimit::kReasons);
  EXPECT_EQ(hosts[0]->port.requests_lost.value(), 0U);
  receiver->stop();
  if (reported < kMany) {
    EXPECT_TRUE(was_logged("warning press: " + std::to_string(kMany - reported) +
                           " further refusals are not reported as events, too many came at once"));
  }
}

TEST_F(RequestReceiverTest, WhatTheEdgeReceivesGoesToTheLineAndItsWarningsToTheLog) {
  edge.receive([](RequestHandler& handler) {
    CommandRequest request{.line = "press", .client = "me"};
    request.command.request = line::SdoRead{};
    request.command.tag = 5;
    handler.on_command(request);
    request.line = "nowhere";
    request.command.tag = 6;
    handler.on_command(request);
  });
  edge.warn("3 datagrams dropped");
  receiver->start();
  for (const std::uint64_t before = receiver->rounds().value();
       receiver->rounds().value() < before + 2;) {
    receiver->wake();
  }
  receiver->stop();
  line::Command command;
  ASSERT_TRUE(hosts[0]->port.commands.pop(command));
  EXPECT_EQ(command.tag, 5U);
  EXPECT_FALSE(hosts[0]->port.commands.pop(command));
  line::Reply reply;
  ASSERT_TRUE(refusals.pop(reply));
  EXPECT_EQ(reply.tag, 6U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::unknown_line));
  EXPECT_TRUE(was_logged("warning 3 datagrams dropped"));
}

}  // namespace
}  // namespace linegate::gateway
