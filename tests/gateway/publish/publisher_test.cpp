// SPDX-License-Identifier: Apache-2.0
// The data of a line, and the samples that the publisher creates from them, without a network.
#include "gateway/publish/publisher.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/log_keeper.h"
#include "tests/gateway/publish/fake_edge.h"

namespace linegate::gateway {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

class PublisherTest : public testing::Test {
 protected:
  PublisherTest() {
    config::LinePlan plan;
    plan.config.name = "press";
    hosts.push_back(std::make_unique<LineHost>(plan, image::Layout{}, image::Layout{}));
    publisher = std::make_unique<Publisher>(edge, hosts);
  }

  LinePort& port() { return hosts[0]->port; }
  // stop() returns only after all available data are published.
  std::vector<std::string> published() {
    publisher->start();
    publisher->stop();
    return edge.samples();
  }

  LogKeeper log;
  FakeEdge edge;
  std::vector<std::unique_ptr<LineHost>> hosts;
  std::unique_ptr<Publisher> publisher;
};

TEST_F(PublisherTest, RepliesComeAfterTheEventsBeforeThemAndStatesAfterBoth) {
  port().replies.push(line::Reply{.tag = 7});
  Event event;
  event.number = 3;
  port().events.push(event);
  port().nodes.push(NodeStatus{.state = {.node = 5}});
  port().status.draft().value = LineStatus{};
  port().status.publish();
  EXPECT_THAT(published(),
              ElementsAre("layout press", "layout press", "event press 3", "reply 7",
                          StartsWith("state press outputs-access=read receive-queue-peak=0"),
                          "node press 5 "));
}

TEST_F(PublisherTest, LayoutsArePublishedOnceAndRefusalsFirst) {
  EXPECT_THAT(published(), ElementsAre("layout press", "layout press"));
  publisher->refusals().push(line::Reply{.tag = 9});
  Event event;
  event.number = 1;
  port().events.push(event);
  EXPECT_THAT(published(), ElementsAre("layout press", "layout press", "reply 9", "event press 1"));
}

TEST_F(PublisherTest, SamplesThatTheEdgeDidNotTakeAreReported) {
  edge.fail(4);
  published();
  const std::vector<std::string> lines = log.lines();
  EXPECT_EQ(std::ranges::count(lines, "warning DDS did not take 4 samples"), 1);
}

}  // namespace
}  // namespace linegate::gateway
