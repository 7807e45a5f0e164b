// SPDX-License-Identifier: Apache-2.0
// Writers that are replaced by new ones: readers lose no sample, and a late joiner has few sequence
// numbers to process.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

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

constexpr std::uint64_t kRenewAfter = 100;

// The samples that a client of this process receives.
struct Received : dds::ClientListener {
  void on_line(const dds::Source&, const dds::LineInfo&, const line::LineState& state,
               const std::vector<dds::Property>&) override {
    load = state.load_permille;
  }
  void on_node(const dds::Source&, const dds::NodeInfo&, const line::NodeState& state,
               const std::vector<dds::Property>&) override {
    nodes.insert(state.node);
  }
  void on_image(const dds::Source&, const image::Snapshot& snapshot) override {
    image = snapshot.sequence;
  }
  void on_event(const dds::Source&, const dds::ReceivedEvent& event, std::string_view,
                const std::vector<dds::Property>&) override {
    events.push_back(event.number);
  }
  void on_line_gone(std::string_view, std::string_view) override { ++lines_gone; }

  unsigned load = 0;
  std::set<unsigned> nodes;
  std::uint64_t image = 0;
  std::vector<std::uint64_t> events;
  int lines_gone = 0;
};

// The writers of a topic from which a raw reader receives samples.
template <class PubSubType>
struct Writers {
  Writers(dds::Endpoints& endpoints, const std::string& topic)
      : reader(endpoints.reader<PubSubType>(topic)) {}

  // Returns the number of different writers so far.
  std::size_t take() {
    fast::SampleInfo info;
    typename PubSubType::type sample;
    while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK)
      seen.insert(info.publication_handle);
    return seen.size();
  }

  fast::DataReader* reader;
  std::set<fast::InstanceHandle_t> seen;
};

class Renewal : public testing::Test {
 protected:
  void SetUp() override {
    dds::GatewayOptions options{
        known::kGateway, 1, domain(), paths::kLoopbackProfiles, {known::kLine}};
    options.renew_after = kRenewAfter;
    auto made = dds::GatewayBridge::make(options);
    ASSERT_TRUE(made.ok());
    bridge = std::move(*made.value);
    client = make_client(client_options());
    ASSERT_NE(client, nullptr);
  }

  void publish(std::uint64_t round) {
    line::LineState state = known::line_state();
    state.load_permille = static_cast<std::uint16_t>(round % 1'000);
    image::Snapshot snapshot = known::snapshot();
    snapshot.sequence = round;
    line::NodeState node = known::node_state();
    node.node = static_cast<std::uint8_t>(1 + round % 3);
    EXPECT_TRUE(bridge->publish(known::line_info(), state, known::at(1)));
    EXPECT_TRUE(bridge->publish(known::kLine, known::node_info(), node, known::at(1)));
    EXPECT_TRUE(bridge->publish(known::kLine, snapshot));
    EXPECT_TRUE(bridge->publish(known::kLine, known::event(round), "text"));
  }
  bool receives(const std::function<bool()>& condition) {
    return eventually(
        [&] {
          client->poll(std::chrono::milliseconds(20), received);
          return condition();
        },
        kDeadline * 3);
  }
  std::unique_ptr<dds::GatewayBridge> bridge;
  std::unique_ptr<dds::Client> client;
  Received received;
};

TEST_F(Renewal, ReadersLoseNothing) {
  constexpr std::size_t kWriters = 3;
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints raw("raw", domain(), paths::kLoopbackProfiles, diagnostics);
  Writers<v1::LineStatePubSubType> lines(raw, v1::TOPIC_LINE_STATE);
  Writers<v1::NodeStatePubSubType> nodes(raw, v1::TOPIC_NODE_STATE);
  Writers<v1::ProcessImagePubSubType> images(raw, v1::TOPIC_PROCESS_IMAGE);
  Writers<v1::EventPubSubType> events(raw, v1::TOPIC_EVENT);
  std::uint64_t round = 0;
  const auto all_renewed = [&] {
    return std::min({lines.take(), nodes.take(), images.take(), events.take()}) >= kWriters;
  };
  // Until the writers of all topics have been replaced twice.
  ASSERT_TRUE(eventually(
      [&] {
        for (int i = 0; i < 20; ++i)
          publish(++round);
        EXPECT_TRUE(receives([&] { return received.events.size() >= round; })) << round;
        return all_renewed() || HasFailure();
      },
      kDeadline * 3))
      << lines.take() << nodes.take() << images.take() << events.take();
  EXPECT_TRUE(receives([&] {
    return received.image == round && received.load == round % 1'000 &&
           received.nodes == std::set<unsigned>{1, 2, 3};
  }));
  std::sort(received.events.begin(), received.events.end());
  for (std::size_t i = 0; i < received.events.size(); ++i)
    ASSERT_EQ(received.events[i], i + 1) << "an event is missing or was received twice";
  EXPECT_EQ(received.events.size(), round);
  EXPECT_EQ(received.lines_gone, 0);
  EXPECT_EQ(bridge->counters().failed, 0U);
}

// Removing a line disposes its instances in both the old and the new writer.
TEST_F(Renewal, ALineThatEndsWhileAWriterIsReplacedIsGone) {
  publish(1);
  // This client reports the end of a line only if it received a state of the line before.
  ASSERT_TRUE(receives([&] { return received.image == 1 && received.load == 1; }));
  for (std::uint64_t round = 2; round <= kRenewAfter + 20; ++round)
    publish(round);
  bridge->remove_line(known::kLine);
  EXPECT_TRUE(receives([&] { return received.lines_gone == 1; }));
  EXPECT_TRUE(bridge->add_line(known::kLine));
  publish(5'000);
  EXPECT_TRUE(receives([&] { return received.image == 5'000; }));
}

// The built-in profiles, with room for that many PDOs.
std::string profiles_with_pdos(int most) {
  std::ifstream file(paths::kLoopbackProfiles);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string limit = std::to_string(most);
  const std::size_t profile = text.find("<data_writer profile_name=\"linegate/v1/PdoUpdate\">");
  for (const char* name : {"<max_samples>", "<max_instances>"}) {
    const std::size_t at = text.find(name, profile) + std::string(name).size();
    text.replace(at, text.find('<', at) - at, limit);
  }
  return text;
}

// Reloads name PDOs anew, until there were more than a writer has instances.
TEST(RenewalOfPdos, AllAreWrittenHoweverOftenTheyAreNamedAnew) {
  constexpr int kMost = 16;
  constexpr std::uint16_t kReloads = 50;
  constexpr std::uint8_t kPdos = 4;
  const File file(profiles_with_pdos(kMost));
  const auto made =
      dds::GatewayBridge::make({known::kGateway, 1, domain(), file.path, {known::kLine}});
  ASSERT_TRUE(made.ok());
  dds::GatewayBridge& bridge = **made.value;
  image::Snapshot snapshot = known::snapshot();
  image::PdoMark& mark = snapshot.marks.at(0);
  for (std::uint16_t reload = 0; reload < kReloads; ++reload) {
    ASSERT_TRUE(bridge.publish(known::kLine, known::layout()));
    mark.remote_pdo = static_cast<std::uint16_t>(reload + 1);
    for (mark.node = 1; mark.node <= kPdos; ++mark.node) {
      ASSERT_TRUE(bridge.publish_pdo_update(known::kLine, known::layout(), snapshot, mark, 1))
          << reload << ", " << unsigned{mark.node};
    }
  }
}

}  // namespace
}  // namespace linegate::test
