// SPDX-License-Identifier: Apache-2.0
// A gateway that follows lines of other gateways receives what is present, in every combination of
// partitions, and nothing of other lines. Malformed samples do no harm.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

struct FollowedLines : dds::GatewayHandler {
  void on_output_write(dds::OutputMessage) override {}
  void on_command(dds::CommandMessage) override {}
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}
  void on_unreadable(std::uint64_t samples) override { unreadable += samples; }
  void on_remote_state(const dds::RemoteSource& source, std::int64_t time) override {
    EXPECT_EQ(source.incarnation, known::kIncarnation);
    states[source.line] = time;
  }
  void on_remote_layout(const dds::RemoteSource& source, const image::Layout& layout) override {
    EXPECT_EQ(layout.id, known::layout().id);
    EXPECT_EQ(layout.entries.size(), known::kEntries);
    ++layouts[source.line];
  }
  void on_remote_image(const dds::RemoteSource& source, const image::Snapshot& image) override {
    EXPECT_EQ(image.bytes, known::snapshot().bytes);
    EXPECT_EQ(image.valid, known::snapshot().valid);
    ++images[source.line];
  }
  bool has_all_of(const dds::RemoteLine& line) const {
    return states.contains(line) && layouts.contains(line) && images.contains(line);
  }

  std::map<dds::RemoteLine, std::int64_t> states;
  std::map<dds::RemoteLine, int> layouts;
  std::map<dds::RemoteLine, int> images;
  std::uint64_t unreadable = 0;
};

std::unique_ptr<dds::GatewayBridge> make_gateway(const std::string& name,
                                                 const std::vector<std::string>& lines,
                                                 bool partitions) {
  dds::GatewayOptions options{name, known::kIncarnation, domain(), paths::kLoopbackProfiles, lines};
  options.last_words = Duration::zero();
  options.partitions = partitions;
  auto made = dds::GatewayBridge::make(options);
  EXPECT_TRUE(made.ok());
  return made.ok() ? std::move(*made.value) : nullptr;
}

void publish(dds::GatewayBridge& bridge, const std::string& line) {
  dds::LineInfo info = known::line_info();
  info.name = line;
  bridge.publish(info, known::line_state(), known::at(1));
  bridge.publish(line, known::layout());
  bridge.publish(line, known::snapshot());
}

// Partitions of the source, and of the gateway that follows it.
class Following : public testing::TestWithParam<std::tuple<bool, bool>> {};
INSTANTIATE_TEST_SUITE_P(Partitions, Following, testing::Combine(testing::Bool(), testing::Bool()));

TEST_P(Following, ReceivesWhatIsPresentOfTheLinesThatItNames) {
  const dds::RemoteLine press{"far", "press"};
  const dds::RemoteLine hall{"far", "hall"};
  const auto far = make_gateway("far", {"press", "hall"}, std::get<0>(GetParam()));
  const auto near = make_gateway("near", {"press"}, std::get<1>(GetParam()));
  ASSERT_TRUE(far && near);
  for (const char* line : {"press", "hall"})
    publish(*far, line);
  publish(*near, "press");
  FollowedLines received;
  ASSERT_TRUE(near->follow({press, {"near", "press"}}));
  EXPECT_TRUE(eventually([&] {
    near->poll(std::chrono::milliseconds(10), received);
    return received.has_all_of(press);
  }));
  publish(*far, "hall");
  publish(*near, "press");
  publish(*far, "press");
  EXPECT_TRUE(eventually([&] {
    near->poll(std::chrono::milliseconds(10), received);
    return received.images[press] > 1;
  }));
  EXPECT_EQ(received.states.size(), 1U) << "of no other line, nor the own one";
  EXPECT_EQ(received.layouts, (std::map<dds::RemoteLine, int>{{press, 1}}))
      << "a layout that is repeated is the same";
  ASSERT_TRUE(near->follow({press, hall}));
  EXPECT_TRUE(eventually([&] {
    near->poll(std::chrono::milliseconds(10), received);
    return received.has_all_of(hall) && received.layouts[press] == 2;
  })) << "what is present, of the first line again";
  ASSERT_TRUE(near->follow({}));
  received = {};
  publish(*far, "press");
  for (int i = 0; i < 20; ++i)
    near->poll(std::chrono::milliseconds(10), received);
  EXPECT_TRUE(received.images.empty());
}

struct UnknownEncoding : v1::LineStatePubSubType {
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const bool done = v1::LineStatePubSubType::serialize(data, payload);
    payload->data[1] = 0x77;
    return done;
  }
};

TEST(FollowedLinesOfStrangers, AreDroppedIfTheyAreMalformed) {
  const dds::RemoteLine press{"far", "press"};
  const auto near = make_gateway("near", {"press"}, false);
  ASSERT_TRUE(near);
  FollowedLines received;
  ASSERT_TRUE(near->follow({press}));
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints stranger("stranger", domain(), paths::kLoopbackProfiles, diagnostics);
  auto* const states = stranger.writer<UnknownEncoding>(v1::TOPIC_LINE_STATE);
  auto* const images = stranger.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
  ASSERT_TRUE(states != nullptr && images != nullptr);
  v1::LineState state;
  state.gateway("far");
  state.line("press");
  v1::ProcessImage image;  // as many marks for changed entries as for valid ones, or it is dropped
  image.gateway("far");
  image.line("press");
  image.changed({1});
  EXPECT_TRUE(eventually([&] {
    states->write(&state);
    images->write(&image);
    near->poll(std::chrono::milliseconds(10), received);
    return received.unreadable > 10;
  }));
  EXPECT_TRUE(received.states.empty());
  EXPECT_TRUE(received.images.empty());
  const auto far = make_gateway("far", {"press"}, false);
  ASSERT_TRUE(far);
  EXPECT_TRUE(eventually([&] {
    publish(*far, "press");
    near->poll(std::chrono::milliseconds(10), received);
    return received.has_all_of(press);
  }));
}

}  // namespace
}  // namespace linegate::test
