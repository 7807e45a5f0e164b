// SPDX-License-Identifier: Apache-2.0
// The cost of a sample for a reader does not grow with the uptime of the gateway: the sequence
// numbers of the samples that a writer keeps stay close together. (Fast DDS sends a GAP for each
// missing number between them, repeatedly: bridges/dds/state_writer.h.)
#include <algorithm>
#include <chrono>
#include <map>
#include <set>
#include <string>
#include <thread>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace fast = eprosima::fastdds::dds;

constexpr int kBusy = 5'000;  // samples of the line that is not quiet
constexpr std::uint64_t kMostApart = 2'048;
constexpr const char* kQuiet = "quiet";

// Clients pause now and then: a reader acknowledges after a heartbeat, and the writer removes
// replies when all readers have acknowledged them. (Without any pause far more replies are kept,
// but still a bounded number.)
constexpr std::uint64_t kBurst = 200;
constexpr std::chrono::milliseconds kPause{150};  // three heartbeat periods

// The sequence numbers that a late joiner receives: the smallest and the largest of each writer.
template <class PubSubType>
struct Kept {
  Kept(dds::Endpoints& endpoints, const std::string& topic)
      : reader(endpoints.reader<PubSubType>(topic)) {}

  void take() {
    fast::SampleInfo info;
    typename PubSubType::type sample;
    while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
      instances.insert(info.instance_handle);
      const std::uint64_t number = info.sample_identity.sequence_number().to64long();
      const auto range = ranges.try_emplace(info.publication_handle, number, number).first;
      range->second.first = std::min(range->second.first, number);
      range->second.second = std::max(range->second.second, number);
      newest = std::max(newest, number);
    }
  }
  std::uint64_t apart() const {
    std::uint64_t most = 0;
    for (const auto& [writer, range] : ranges)
      most = std::max(most, range.second - range.first);
    return most;
  }

  fast::DataReader* reader;
  std::map<fast::InstanceHandle_t, std::pair<std::uint64_t, std::uint64_t>> ranges;
  std::set<fast::InstanceHandle_t> instances;
  std::uint64_t newest = 0;
};

class Gaps : public testing::Test {
 protected:
  void SetUp() override {
    auto made = dds::GatewayBridge::make(
        {known::kGateway, 1, domain(), paths::kLoopbackProfiles, {known::kLine, kQuiet}});
    ASSERT_TRUE(made.ok());
    bridge = std::move(*made.value);
  }

  void publish(const char* line, std::uint8_t node, image::Direction direction) {
    ++number;
    dds::LineInfo info = known::line_info();
    info.name = line;
    line::NodeState state = known::node_state();
    state.node = node;
    image::Layout layout = known::layout();
    layout.entries.resize(3);
    layout.direction = direction;
    image::Snapshot snapshot = known::snapshot();
    snapshot.direction = direction;
    snapshot.sequence = number;
    EXPECT_TRUE(bridge->publish(info, known::line_state(), known::at(1)));
    EXPECT_TRUE(bridge->publish(line, known::node_info(), state, known::at(1)));
    EXPECT_TRUE(bridge->publish(line, layout));
    EXPECT_TRUE(bridge->publish(line, snapshot));
    EXPECT_TRUE(bridge->publish(line, known::event(number), "text"));
  }

  // Returns the distance of the sequence numbers kept for a topic, once all of its instances and
  // sample `newest` have arrived.
  template <class PubSubType>
  std::uint64_t apart(const std::string& topic, std::size_t instances, std::uint64_t newest) {
    Kept<PubSubType> kept(late, topic);
    EXPECT_TRUE(eventually([&] {
      kept.reader->wait_for_unread_message({0, 50'000'000});
      kept.take();
      return kept.instances.size() >= instances && kept.newest >= newest;
    })) << topic
        << ": " << kept.instances.size() << " instances, newest " << kept.newest;
    return kept.apart();
  }

  std::vector<Diagnostic> diagnostics;
  std::unique_ptr<dds::GatewayBridge> bridge;
  dds::Endpoints late{"late", domain(), paths::kLoopbackProfiles, diagnostics};
  std::uint64_t number = 0;
};

TEST_F(Gaps, OfTheGatewaysTopicsStaySmall) {
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs})
    publish(kQuiet, 1, direction);
  publish(known::kLine, 2, image::Direction::outputs);
  for (int i = 0; i < kBusy; ++i)
    publish(known::kLine, 3, image::Direction::inputs);
  EXPECT_LE(apart<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE, 2, kBusy), kMostApart);
  EXPECT_LE(apart<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE, 3, kBusy), kMostApart);
  EXPECT_LE(apart<v1::ImageLayoutPubSubType>(v1::TOPIC_IMAGE_LAYOUT, 4, kBusy), kMostApart);
  EXPECT_LE(apart<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE, 4, kBusy), kMostApart);
  EXPECT_LE(apart<v1::EventPubSubType>(v1::TOPIC_EVENT, 2, kBusy), kMostApart);
  EXPECT_EQ(bridge->counters().failed, 0U);
}

// A subscriber that joins after the end of a line receives only the events of that line.
TEST_F(Gaps, OfALineThatEndedStaySmall) {
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs})
    publish(kQuiet, 1, direction);
  bridge->remove_line(kQuiet);
  for (int i = 0; i < kBusy; ++i)
    publish(known::kLine, 3, image::Direction::inputs);
  EXPECT_LE(apart<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE, 1, kBusy), kMostApart);
  EXPECT_LE(apart<v1::NodeStatePubSubType>(v1::TOPIC_NODE_STATE, 1, kBusy), kMostApart);
  EXPECT_LE(apart<v1::ImageLayoutPubSubType>(v1::TOPIC_IMAGE_LAYOUT, 1, kBusy), kMostApart);
  EXPECT_EQ(bridge->counters().failed, 0U);
  EXPECT_TRUE(bridge->add_line(kQuiet));
  publish(kQuiet, 1, image::Direction::inputs);
}

// Answers every command at once.
struct Answering : dds::GatewayHandler {
  void on_output_write(dds::OutputMessage) override {}
  void on_command(dds::CommandMessage message) override {
    line::Reply reply;
    reply.tag = message.command.tag;
    bridge->reply(reply);
  }
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}

  dds::GatewayBridge* bridge = nullptr;
};

TEST_F(Gaps, OfRepliesStaySmall) {
  Answering answering;
  answering.bridge = bridge.get();
  const auto ask = [&](fast::DataWriter* writer, const char* client, std::uint64_t id) {
    v1::CommandRequest request;
    request.gateway(known::kGateway);
    request.line(known::kLine);
    request.client(client);
    request.id(id);
    request.kind(v1::COMMAND_LOCAL_READ);
    request.last(true);
    EXPECT_TRUE(writer->write(&request));
  };
  auto* writer = late.writer<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST);
  Kept<v1::CommandReplyPubSubType> replies(late, v1::TOPIC_COMMAND_REPLY);
  const auto await = [&](std::uint64_t sequence) {
    return eventually([&] {
      bridge->poll(std::chrono::milliseconds(1), answering);
      replies.take();
      return replies.newest >= sequence;
    });
  };
  EXPECT_TRUE(eventually([&] {
    ask(writer, "quiet", 1);
    bridge->poll(std::chrono::milliseconds(50), answering);
    replies.take();
    return replies.newest > 0;
  }));
  for (std::uint64_t id = 1; id <= kBusy; ++id) {
    const std::uint64_t before = replies.newest;
    ask(writer, "busy", id);
    ASSERT_TRUE(await(before + 1)) << id;
    if (id % kBurst == 0)
      std::this_thread::sleep_for(kPause);
  }
  EXPECT_GE(replies.newest, kBusy);
  EXPECT_LE(apart<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY, 1, replies.newest),
            kMostApart);
}

}  // namespace
}  // namespace linegate::test
