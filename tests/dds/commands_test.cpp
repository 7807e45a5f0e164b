// Requests and replies between two processes.
#include <thread>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/waiting.h"
#include "stack/base/byte_order.h"

#include "tests/dds/fixtures.h"

namespace linegate::test {
namespace {

line::Command sdo_read(std::uint16_t index, std::uint8_t kilobytes, std::uint8_t node = 9) {
  line::Command command;
  command.kind = line::CommandKind::sdo_read;
  command.node = node;
  command.index = index;
  command.sub = kilobytes;
  return command;
}

line::Command sdo_write(std::size_t size, std::uint8_t node = 9) {
  line::Command command;
  command.kind = line::CommandKind::sdo_write;
  command.node = node;
  command.index = 0x2000;
  command.data = known::pattern(size, node);
  return command;
}

class Commands : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(gateway.expect("ready").empty());
    client = make_client(client_options());
    ASSERT_NE(client, nullptr);
  }
  dds::CommandResult call(const line::Command& command) {
    return client->call(known_line(), command, kDeadline, listener);
  }
  std::uint32_t carried_out() {
    line::Command command;
    command.kind = line::CommandKind::local_read;
    const auto result = call(command);
    EXPECT_EQ(result.reply.data.size(), 4U);
    return result.reply.data.size() == 4 ? load_le<std::uint32_t>(result.reply.data.data()) : 0;
  }

  Peer gateway{"gateway"};
  std::unique_ptr<dds::Client> client;
  dds::ClientListener listener;
};

TEST_F(Commands, AFreshClientGetsItsFirstReply) {
  const auto result = call(sdo_read(0x2000, 1));
  EXPECT_TRUE(result.reply.ok()) << result.text;
  EXPECT_EQ(result.reply.data, known::pattern(1'024, 9));
}

TEST_F(Commands, AnAbortCodeComesWithItsWords) {
  const auto result = call(sdo_read(0x1234, 1));
  EXPECT_EQ(result.reply.error, (Error{Domain::sdo, 0x0602'0000}));
  EXPECT_EQ(result.text, "object does not exist in the object dictionary");
}

TEST_F(Commands, TwentyKilobytesGoInChunksBothWays) {
  EXPECT_EQ(call(sdo_read(0x2000, 20)).reply.data, known::pattern(20'480, 9));
  const auto written = call(sdo_write(20'480));
  EXPECT_TRUE(written.reply.ok()) << written.text;
  ASSERT_EQ(written.reply.data.size(), 4U);
  EXPECT_EQ(load_le<std::uint32_t>(written.reply.data.data()), 20'480U);
}

TEST_F(Commands, ALongReplyIsFetchedInRoundsAndNeverOverrunsTheReader) {
  EXPECT_EQ(call(sdo_read(0x2000, 250)).reply.data, known::pattern(250 * 1'024, 9));
  EXPECT_EQ(carried_out(), 1U);
}

TEST_F(Commands, ALongRequestArrivesWhole) {
  const auto written = call(sdo_write(1'000'000));
  EXPECT_TRUE(written.reply.ok()) << written.text;
  EXPECT_EQ(carried_out(), 1U);
}

TEST_F(Commands, ManyAtOnceAreEachAnsweredOnce) {
  struct Replies : dds::ClientListener {
    void on_reply(const dds::Target& target, const dds::CommandResult& result) override {
      EXPECT_EQ(target.line, known::kLine);
      EXPECT_TRUE(result.reply.ok()) << result.text;
      EXPECT_EQ(result.reply.data.size(), 1'024U);
      ++ids[result.id];
    }
    std::map<std::uint64_t, int> ids;
  } replies;
  std::set<std::uint64_t> sent;
  for (int i = 0; i < 100; ++i) {
    sent.insert(client->send(known_line(), sdo_read(0x2000, 1), kDeadline));
  }
  EXPECT_EQ(sent.size(), 100U);
  EXPECT_TRUE(eventually([&] {
    client->poll(std::chrono::milliseconds(50), replies);
    return replies.ids.size() == 100;
  }));
  for (const auto& [id, count] : replies.ids) {
    EXPECT_TRUE(sent.contains(id));
    EXPECT_EQ(count, 1);
  }
  EXPECT_EQ(carried_out(), 100U);
}

TEST_F(Commands, NobodyAnswersForAGatewayThatIsNotThere) {
  const auto result = client->call({"nowhere", "line1", 0}, sdo_read(0x2000, 1),
                                   std::chrono::milliseconds(300), listener);
  EXPECT_EQ(result.reply.error, line::to_error(line::Refusal::timed_out));
}

TEST_F(Commands, ATimeOutOfCenturiesIsNotOver) {
  const auto result = client->call(known_line(), sdo_read(0x2000, 1), Duration::max(), listener);
  EXPECT_TRUE(result.reply.ok()) << result.text;
}

TEST(Waiting, ForCenturiesEndsWhenWoken) {
  dds::Waiting waiting;
  std::thread waker([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    waiting.wake();
  });
  EXPECT_TRUE(waiting.wait(std::chrono::hours(1'000'000)));
  waker.join();
}

// A client by hand, on the topics themselves; any number of names.
struct Stranger {
  explicit Stranger(std::vector<Diagnostic>& diagnostics)
      : endpoints("stranger", domain(), LOOPBACK_PROFILES, diagnostics),
        writer(endpoints.writer<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST)),
        reader(endpoints.reader<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY)) {
    request.gateway(known::kGateway);
    request.line(known::kLine);
    request.kind(v1::COMMAND_SDO_READ);
    request.node(9);
    request.sub(1);
    request.last(true);
  }

  // Sends the request, and gives how many answers came to it within 100 ms or at least one.
  int ask(const std::string& client, std::uint64_t id) {
    request.client(client);
    request.id(id);
    EXPECT_TRUE(writer->write(&request));
    int answers = 0;
    while (answers == 0 && reader->wait_for_unread_message({0, 100'000'000})) {
      v1::CommandReply reply;
      eprosima::fastdds::dds::SampleInfo info;
      while (reader->take_next_sample(&reply, &info) == ReturnCode_t::RETCODE_OK) {
        if (!info.valid_data || reply.client() != client.c_str() || reply.id() != id)
          continue;
        EXPECT_EQ(reply.data().size(), 1'024U);
        ++answers;
      }
    }
    return answers;
  }

  dds::Endpoints endpoints;
  eprosima::fastdds::dds::DataWriter* writer;
  eprosima::fastdds::dds::DataReader* reader;
  v1::CommandRequest request;
};

TEST_F(Commands, ADuplicateIsCarriedOutOnceAndAnsweredEachTime) {
  std::vector<Diagnostic> diagnostics;
  Stranger stranger(diagnostics);
  int answers = 0;
  EXPECT_TRUE(eventually([&] { return (answers += stranger.ask("stranger", 5)) >= 5; }));
  EXPECT_EQ(carried_out(), 1U);
}

TEST_F(Commands, MoreClientsThanInstancesAreServed) {
  constexpr int kStrangers = 5;
  constexpr int kClients = 250;  // of each: more than CommandReply has instances for
  std::vector<Diagnostic> diagnostics;
  std::vector<std::unique_ptr<Stranger>> strangers;
  for (int i = 0; i < kStrangers; ++i) {
    strangers.push_back(std::make_unique<Stranger>(diagnostics));
    for (int number = 0; number < kClients; ++number) {
      const std::string name = std::to_string(i) + "/" + std::to_string(number);
      ASSERT_TRUE(eventually([&] { return strangers.back()->ask(name, 5) > 0; })) << name;
    }
  }
  EXPECT_EQ(carried_out(), 1'250U);
}

// The operator's profiles, but for three instances of commands and outputs.
std::string few_instances() {
  std::ifstream file(LOOPBACK_PROFILES);
  std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto shrink = [&](const std::string& profile, int depth) {
    const std::size_t at = text.find(profile);
    ASSERT_NE(at, std::string::npos);
    const auto set = [&](const std::string& tag, int value) {
      const std::size_t begin = text.find("<" + tag + ">", at) + tag.size() + 2;
      text.replace(begin, text.find('<', begin) - begin, std::to_string(value));
    };
    set("max_samples", 3 * depth);
    set("max_instances", 3);
  };
  shrink("<data_reader profile_name=\"linegate/v1/CommandRequest\">", 256);
  shrink("<data_reader profile_name=\"linegate/v1/OutputWrite\">", 1);
  shrink("<data_writer profile_name=\"linegate/v1/CommandReply\">", 16);
  return text;
}

class FewInstances : public testing::Test {
 protected:
  void SetUp() override { ASSERT_FALSE(gateway.expect("ready").empty()); }

  const File profiles{few_instances()};
  Peer gateway{"gateway", profiles.path};
  std::vector<Diagnostic> diagnostics;
};

TEST_F(FewInstances, ClientsComeAndGo) {
  dds::ClientListener listener;
  for (int i = 0; i < 8; ++i) {
    const auto client = make_client(client_options());
    ASSERT_NE(client, nullptr);
    const auto result = client->call(known_line(), sdo_read(0x2000, 1), kDeadline, listener);
    ASSERT_TRUE(result.reply.ok()) << i << result.text;
  }
}

TEST_F(FewInstances, AStrangerWhoUsesThemAllShutsNobodyOut) {
  Stranger stranger(diagnostics);
  for (int i = 0; i < 8; ++i) {
    const std::string name = "name " + std::to_string(i);
    ASSERT_TRUE(eventually([&] { return stranger.ask(name, 5) > 0; })) << name;
  }
  dds::ClientListener listener;
  const auto client = make_client(client_options());
  ASSERT_NE(client, nullptr);
  EXPECT_TRUE(client->call(known_line(), sdo_read(0x2000, 1), kDeadline, listener).reply.ok());
}

TEST_F(FewInstances, OutputsOfManyGroupsArrive) {
  dds::Endpoints stranger("stranger", domain(), LOOPBACK_PROFILES, diagnostics);
  auto* writer = stranger.writer<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
  ASSERT_NE(writer, nullptr);
  v1::OutputWrite sample;
  sample.gateway(known::kGateway);
  sample.line(known::kLine);
  sample.client("stranger");
  for (std::uint16_t group = 0; group < 8; ++group) {
    sample.group(group);
    const std::string told = "output line=line1 client=stranger group=" + std::to_string(group);
    EXPECT_TRUE(eventually([&] {
      return writer->write(&sample) &&
             !gateway.expect(told, std::chrono::milliseconds(100)).empty();
    })) << group;
  }
}

}  // namespace
}  // namespace linegate::test
