// SPDX-License-Identifier: Apache-2.0
// Partitions of lines without DDS-Security: a reader in the partition of a line receives what
// belongs to this line and to the gateway, one in the default partition receives everything.
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/command_samples.h"
#include "bridges/dds/endpoints.h"
#include "bridges/dds/publisher.h"
#include "bridges/dds/sample_port.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

using Names = std::set<std::string>;

const Names kTopicsOfLines{v1::TOPIC_LINE_STATE,   v1::TOPIC_NODE_STATE,    v1::TOPIC_OUTPUT_STATE,
                           v1::TOPIC_IMAGE_LAYOUT, v1::TOPIC_PROCESS_IMAGE, v1::TOPIC_PDO_UPDATE,
                           v1::TOPIC_PDO_RECEPTION};

// Readers of all topics of a gateway in one partition; empty: in the default partition.
class Readers {
 public:
  Readers(dds::Endpoints& endpoints, const std::string& partition) {
    add<v1::GatewayStatePubSubType>(endpoints, partition, v1::TOPIC_GATEWAY_STATE);
    add<v1::LineStatePubSubType>(endpoints, partition, v1::TOPIC_LINE_STATE);
    add<v1::NodeStatePubSubType>(endpoints, partition, v1::TOPIC_NODE_STATE);
    add<v1::OutputStatePubSubType>(endpoints, partition, v1::TOPIC_OUTPUT_STATE);
    add<v1::ImageLayoutPubSubType>(endpoints, partition, v1::TOPIC_IMAGE_LAYOUT);
    add<v1::ProcessImagePubSubType>(endpoints, partition, v1::TOPIC_PROCESS_IMAGE);
    add<v1::PdoUpdatePubSubType>(endpoints, partition, v1::TOPIC_PDO_UPDATE);
    add<v1::PdoReceptionPubSubType>(endpoints, partition, v1::TOPIC_PDO_RECEPTION);
    add<v1::EventPubSubType>(endpoints, partition, v1::TOPIC_EVENT);
    add<v1::CommandReplyPubSubType>(endpoints, partition, v1::TOPIC_COMMAND_REPLY);
  }

  // The lines of which samples were received, by topic; "gateway" for GatewayState.
  const std::map<std::string, Names>& take() {
    for (const auto& read : reads_)
      read();
    return lines_;
  }

 private:
  template <class PubSubType>
  void add(dds::Endpoints& endpoints, const std::string& partition, const std::string& topic) {
    auto* const reader = partition.empty() ? endpoints.reader<PubSubType>(topic)
                                           : endpoints.reader_in<PubSubType>(partition, topic);
    ASSERT_NE(reader, nullptr) << topic;
    reads_.emplace_back([this, reader, topic] {
      typename PubSubType::type sample;
      eprosima::fastdds::dds::SampleInfo info;
      while (reader->take_next_sample(&sample, &info) ==
             eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data)
          continue;
        if constexpr (requires { sample.line(); }) {
          lines_[topic].insert(sample.line().to_string());
        } else {
          lines_[topic].insert("gateway");
        }
      }
    });
  }

  std::vector<std::function<void()>> reads_;
  std::map<std::string, Names> lines_;
};

// What readers in those partitions receive of lines; the gateway itself is the line "".
std::map<std::string, Names> expected(const Names& lines) {
  std::map<std::string, Names> out{{v1::TOPIC_GATEWAY_STATE, {"gateway"}},
                                   {v1::TOPIC_EVENT, lines}};
  out[v1::TOPIC_EVENT].insert("");
  for (const std::string& topic : kTopicsOfLines)
    out[topic] = lines;
  return out;
}

struct Requests : dds::GatewayHandler {
  void on_output_write(dds::OutputMessage) override {}
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view why) override {
    ADD_FAILURE() << why;
  }
  void on_command(dds::CommandMessage message) override {
    clients.insert(message.client);
    line::Reply reply;
    reply.tag = message.command.tag;
    bridge->reply(reply);
  }
  dds::GatewayBridge* bridge = nullptr;
  Names clients;
};

class Partitions : public testing::Test {
 protected:
  void start(bool partitions) {
    dds::GatewayOptions options{"plant", 1, domain(), paths::kLoopbackProfiles, {"press"}};
    options.last_words = Duration::zero();
    options.renew_after = 20;  // the writers that replace others have the same partitions
    options.partitions = partitions;
    auto made = dds::GatewayBridge::make(options);
    ASSERT_TRUE(made.ok());
    bridge = std::move(*made.value);
    ASSERT_TRUE(bridge->add_line("hall"));
    handler.bridge = bridge.get();
  }
  void publish() {
    ++round;
    bridge->publish(known::gateway_info(), known::at(1));
    bridge->publish("", known::event(round), "text");
    for (const char* line : {"press", "hall"}) {
      dds::LineInfo info = known::line_info();
      info.name = line;
      image::Snapshot snapshot = known::snapshot();
      snapshot.sequence = round;
      bridge->publish(info, known::line_state(), known::at(1));
      bridge->publish(line, known::node_info(), known::node_state(), known::at(1));
      bridge->publish(line, known::output_state(), known::at(1));
      bridge->publish(line, known::layout());
      bridge->publish(line, snapshot);
      bridge->publish_pdo_update(line, known::layout(), snapshot, snapshot.marks.at(0), 1);
      bridge->publish(line, known::layout(), known::reception());
      bridge->publish(line, known::event(round), "text");
    }
    bridge->poll(std::chrono::milliseconds(2), handler);
  }

  std::unique_ptr<dds::GatewayBridge> bridge;
  Requests handler;
  std::uint64_t round = 0;
  std::vector<Diagnostic> diagnostics;
};

TEST_F(Partitions, AReaderReceivesTheLineOfItsPartition) {
  ASSERT_NO_FATAL_FAILURE(start(true));
  dds::Endpoints endpoints("reader", domain(), paths::kLoopbackProfiles, diagnostics);
  Readers all(endpoints, "");
  Readers of_gateway(endpoints, "plant/*");
  Readers of_press(endpoints, "plant/press");
  Readers of_other(endpoints, "other/press");
  EXPECT_TRUE(eventually([&] {
    publish();
    return round > 100 && all.take() == expected({"press", "hall"}) &&
           of_gateway.take() == expected({"press", "hall"}) &&
           of_press.take() == expected({"press"});
  }));
  EXPECT_EQ(all.take(), expected({"press", "hall"}));
  EXPECT_EQ(of_gateway.take(), expected({"press", "hall"}));
  EXPECT_EQ(of_press.take(), expected({"press"}));
  EXPECT_TRUE(of_other.take().empty());
}

TEST_F(Partitions, RequestsAreReceivedInThePartitionOfALineAndInTheDefaultOne) {
  ASSERT_NO_FATAL_FAILURE(start(true));
  dds::Endpoints endpoints("client", domain(), paths::kLoopbackProfiles, diagnostics);
  Readers of_press(endpoints, "plant/press");
  std::map<std::string, eprosima::fastdds::dds::DataWriter*> writers{
      {"default", endpoints.writer<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST)}};
  for (const char* partition : {"plant/press", "other/press"}) {
    writers[partition] =
        endpoints.writer_in<v1::CommandRequestPubSubType>(partition, v1::TOPIC_COMMAND_REQUEST);
  }
  std::uint64_t id = 0;
  EXPECT_TRUE(eventually([&] {
    for (const auto& [client, writer] : writers) {
      v1::CommandRequest request;
      request.gateway("plant");
      request.line("press");
      request.client(client);
      request.id(++id);
      request.last(true);
      dds::to_wire(line::Request(line::NmtRequest{.node = 5}), Duration::zero(), request);
      writer->write(&request);
    }
    publish();
    const auto& received = of_press.take();
    return handler.clients.size() == 2 && received.contains(v1::TOPIC_COMMAND_REPLY);
  }));
  EXPECT_EQ(handler.clients, (Names{"default", "plant/press"}));
}

// What a client receives: lines of LineState, of images, and those that GatewayState names.
struct ReceivedLines : dds::ClientListener {
  void on_gateway(const dds::Source&, const dds::GatewayInfo& info) override {
    for (const dds::GatewayInfo::Line& line : info.lines)
      of_gateway.insert(line.name);
    ++gateways;
  }
  void on_line(const dds::Source& source, const dds::LineInfo&, const line::LineState&,
               const std::vector<dds::Property>&) override {
    lines.insert(source.line);
  }
  void on_image(const dds::Source& source, const image::Snapshot&) override {
    images.insert(source.line);
  }
  void on_reply(const dds::Target&, const dds::CommandResult& result) override {
    answered = answered || result.reply.ok();
  }
  Names of_gateway;
  Names lines;
  Names images;
  int gateways = 0;
  bool answered = false;
};

TEST_F(Partitions, AClientReceivesTheLinesThatItNamesAlone) {
  ASSERT_NO_FATAL_FAILURE(start(true));
  dds::ClientOptions options = client_options();
  options.commands = true;
  options.only = {"plant/press", "other/hall"};
  const auto client = make_client(options);
  ASSERT_NE(client, nullptr);
  ReceivedLines received;
  client->send({"plant", "press", 0}, {.request = line::SdoRead{.node = 5}},
               std::chrono::minutes(1));
  EXPECT_TRUE(eventually([&] {
    publish();
    client->poll(std::chrono::milliseconds(2), received);
    return round > 100 && received.answered && received.images.size() == 1 && received.gateways > 1;
  }));
  EXPECT_EQ(received.lines, Names{"press"});
  EXPECT_EQ(received.images, Names{"press"});
  EXPECT_FALSE(received.of_gateway.contains("hall"));
  EXPECT_EQ(client->peers().gateways, std::vector<std::string>{"plant"});
}

TEST(LinesOfClients, AreNamedWithTheirGatewayAndWithoutWildcards) {
  EXPECT_TRUE(dds::is_line_name("plant/press"));
  for (const char* text : {"", "press", "/press", "plant/", "plant/press/more", "*/press",
                           "plant/pr?ss", "plant/[p]ress"})
    EXPECT_FALSE(dds::is_line_name(text)) << text;
}

TEST_F(Partitions, WithoutThemEverythingIsInTheDefaultPartition) {
  ASSERT_NO_FATAL_FAILURE(start(false));
  dds::Endpoints endpoints("reader", domain(), paths::kLoopbackProfiles, diagnostics);
  Readers all(endpoints, "");
  Readers of_press(endpoints, "plant/press");
  EXPECT_TRUE(eventually([&] {
    publish();
    return all.take() == expected({"press", "hall"});
  }));
  EXPECT_EQ(all.take(), expected({"press", "hall"}));
  EXPECT_TRUE(of_press.take().empty());
}

// A line that is added has writers of its own, whose liveliness another thread asserts.
TEST(SamplePorts, ALineIsAddedWhileAnotherThreadWaitsForRequests) {
  dds::GatewayOptions options{"plant", 1, domain(), paths::kLoopbackProfiles, {"press"}};
  options.last_words = Duration::zero();
  options.partitions = true;
  auto made = dds::make_local_port(options);
  ASSERT_TRUE(made.ok());
  dds::SamplePort& port = **made.value;
  std::atomic<bool> stop = false;
  std::thread waiting([&] {
    while (!stop)
      port.wait(std::chrono::milliseconds(1));
  });
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(port.add_line("line " + std::to_string(i)));
    std::this_thread::sleep_for(
        std::chrono::milliseconds(200));  // liveliness is asserted twice a second
  }
  stop = true;
  waiting.join();
}

}  // namespace
}  // namespace linegate::test
