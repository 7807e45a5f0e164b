// SPDX-License-Identifier: Apache-2.0
// Command requests and replies between two processes.
#include <array>
#include <string>
#include <thread>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>
#include <signal.h>
#include <unistd.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/waiting.h"
#include "stack/base/byte_order.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

line::Command sdo_read(std::uint16_t index, std::uint8_t kilobytes, std::uint8_t node = 9) {
  line::Command command{.request = line::SdoRead{.node = node, .address = {index, kilobytes}}};
  return command;
}

line::Command sdo_write(std::size_t size, std::uint8_t node = 9) {
  line::Command command{
      .request =
          line::SdoWrite{.node = node, .address = {0x2000, 0}, .data = known::pattern(size, node)}};
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
    line::Command command{.request = line::LocalRead{}};
    const auto result = call(command);
    EXPECT_EQ(result.reply.bytes().size(), 4U);
    return result.reply.bytes().size() == 4 ? load_le<std::uint32_t>(result.reply.bytes().data())
                                            : 0;
  }

  Peer gateway{"gateway"};
  std::unique_ptr<dds::Client> client;
  dds::ClientListener listener;
};

TEST_F(Commands, AFreshClientGetsItsFirstReply) {
  const auto result = call(sdo_read(0x2000, 1));
  EXPECT_TRUE(result.reply.ok()) << result.text;
  EXPECT_EQ(result.reply.bytes(), known::pattern(1'024, 9));
}

TEST_F(Commands, AnAbortCodeComesWithItsWords) {
  const auto result = call(sdo_read(0x1234, 1));
  EXPECT_EQ(result.reply.error, (Error{Domain::sdo, 0x0602'0000}));
  EXPECT_EQ(result.text, "object does not exist in the object dictionary");
}

TEST_F(Commands, TwentyKilobytesGoInChunksBothWays) {
  EXPECT_EQ(call(sdo_read(0x2000, 20)).reply.bytes(), known::pattern(20'480, 9));
  const auto written = call(sdo_write(20'480));
  EXPECT_TRUE(written.reply.ok()) << written.text;
  ASSERT_EQ(written.reply.bytes().size(), 4U);
  EXPECT_EQ(load_le<std::uint32_t>(written.reply.bytes().data()), 20'480U);
}

TEST_F(Commands, ALongReplyIsFetchedInRoundsAndNeverOverrunsTheReader) {
  EXPECT_EQ(call(sdo_read(0x2000, 250)).reply.bytes(), known::pattern(250 * 1'024, 9));
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
      EXPECT_EQ(result.reply.bytes().size(), 1'024U);
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

// A participant that answers requests in place of the gateway, with any names that it likes.
class Impostor {
 public:
  Impostor()
      : endpoints_("impostor", domain(), paths::kLoopbackProfiles, diagnostics_),
        lines_(endpoints_.writer<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE)),
        replies_(endpoints_.writer<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY)),
        requests_(endpoints_.reader<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST)) {}

  void claim_line() {
    v1::LineState state;
    state.gateway(known::kGateway);
    state.line(known::kLine);
    state.incarnation(known::kIncarnation);
    EXPECT_TRUE(lines_->write(&state));
  }
  // Answers all requests received so far. Returns their number.
  int forge() {
    int forged = 0;
    v1::CommandRequest request;
    eprosima::fastdds::dds::SampleInfo info;
    while (requests_->take_next_sample(&request, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data)
        continue;
      v1::CommandReply reply;
      reply.gateway(request.gateway());
      reply.line(request.line());
      reply.client(request.client());
      reply.id(request.id());
      reply.last(true);
      reply.data().assign(3, 0x66);
      forged += replies_->write(&reply) ? 1 : 0;
    }
    return forged;
  }

 private:
  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_;
  eprosima::fastdds::dds::DataWriter* lines_;
  eprosima::fastdds::dds::DataWriter* replies_;
  eprosima::fastdds::dds::DataReader* requests_;
};

// Takes answers, while an impostor answers each request, too.
struct Answers : dds::ClientListener {
  void on_reply(const dds::Target&, const dds::CommandResult& result) override {
    results.push_back(result);
  }
  std::vector<dds::CommandResult> results;
};

TEST_F(Commands, TheReplyOfAnotherParticipantIsIgnored) {
  ASSERT_TRUE(call(sdo_read(0x2000, 1)).reply.ok());
  Impostor impostor;
  Answers answers;
  ASSERT_TRUE(eventually([&] {
    // The gateway is stopped, so that only the impostor answers.
    gateway.signal(SIGSTOP);
    client->send(known_line(), sdo_read(0x2000, 1), kDeadline);
    const bool refused = eventually(
        [&] {
          client->poll(std::chrono::milliseconds(10), answers);
          impostor.forge();
          return client->foreign_replies() != 0;
        },
        std::chrono::seconds(1));
    gateway.signal(SIGCONT);
    return refused;
  }));
  EXPECT_TRUE(eventually([&] {
    client->poll(std::chrono::milliseconds(10), answers);
    impostor.forge();
    return !answers.results.empty();
  }));
  for (const dds::CommandResult& result : answers.results) {
    EXPECT_EQ(result.reply.bytes(), known::pattern(1'024, 9));
  }
}

TEST_F(Commands, TwoParticipantsThatPublishALineAreAnErrorInPlaceOfAnAnswer) {
  // This participant publishes the line in turns with the impostor.
  Impostor first;
  Impostor second;
  const dds::Target line = known_line();
  Answers answers;
  EXPECT_TRUE(eventually([&] {
    first.claim_line();
    client->poll(std::chrono::milliseconds(10), answers);
    second.claim_line();
    client->poll(std::chrono::milliseconds(10), answers);
    if (client->send(line, sdo_read(0x2000, 1), kDeadline) == 0)
      return false;
    client->poll(std::chrono::milliseconds(10), answers);
    second.forge();
    return !answers.results.empty() &&
           answers.results.back().reply.error == line::to_error(line::Refusal::not_permitted);
  }));
  ASSERT_FALSE(answers.results.empty());
  EXPECT_EQ(answers.results.back().text.find("several DDS participants publish line "), 0U)
      << answers.results.back().text;
  // Both claimants are on this host.
  std::array<char, 65> name{};
  ::gethostname(name.data(), name.size() - 1);
  const std::string host = std::string(" at ") + name.data();
  const std::string& text = answers.results.back().text;
  const std::size_t at = text.find(host);
  EXPECT_NE(at, std::string::npos) << text;
  EXPECT_NE(text.find(host, at + 1), std::string::npos) << text;
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

// A client without dds::Client: it writes requests and reads replies on the topics, under any
// number of client names.
struct Stranger {
  explicit Stranger(std::vector<Diagnostic>& diagnostics)
      : endpoints("stranger", domain(), paths::kLoopbackProfiles, diagnostics),
        writer(endpoints.writer<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST)),
        reader(endpoints.reader<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY)) {
    request.gateway(known::kGateway);
    request.line(known::kLine);
    request.kind(v1::COMMAND_SDO_READ);
    request.node(9);
    request.sub(1);
    request.last(true);
  }

  // Sends the request and returns the number of replies to it. Waits until there is at least one
  // reply, at most 100 ms after the last sample.
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
  constexpr int kClients = 250;  // per stranger: more than the number of instances of CommandReply
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

// The text of the test profiles, for tests that change it.
class ProfileText {
 public:
  ProfileText() {
    std::ifstream file(paths::kLoopbackProfiles);
    text_.assign(std::istreambuf_iterator<char>(file), {});
  }
  const std::string& text() const { return text_; }

  // Sets the value of the first element with that path in the profile. path: nested tags, as in
  // "topic><kind".
  void set(const std::string& profile, const std::string& path, std::uint32_t value) {
    const std::size_t begin = find("<" + path + ">", find(profile, 0)) + path.size() + 2;
    text_.replace(begin, text_.find('<', begin) - begin, std::to_string(value));
  }
  void set_instances(const std::string& profile, std::uint32_t instances, std::uint32_t depth) {
    set(profile, "max_samples", instances * depth);
    set(profile, "max_instances", instances);
  }
  // Adds an element at the end of the profile.
  void add(const std::string& profile, const std::string& element) {
    text_.insert(find("<historyMemoryPolicy>", find(profile, 0)), element);
  }

 private:
  std::size_t find(const std::string& what, std::size_t from) const {
    const std::size_t at = text_.find(what, from);
    EXPECT_NE(at, std::string::npos) << what;
    return at;
  }
  std::string text_;
};

std::string few_instances() {
  ProfileText profiles;
  profiles.set_instances("<data_reader profile_name=\"linegate/v1/CommandRequest\">", 3, 256);
  profiles.set_instances("<data_reader profile_name=\"linegate/v1/OutputWrite\">", 3, 4);
  profiles.set_instances("<data_writer profile_name=\"linegate/v1/CommandReply\">", 3, 16);
  return profiles.text();
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
  dds::Endpoints stranger("stranger", domain(), paths::kLoopbackProfiles, diagnostics);
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

// The writer of replies sends heartbeats without a pause, because one reader never acknowledges.
// Fast DDS must not find samples in the writer's history while they are being removed
// (Endpoints::remove).
std::string busy_heartbeats() {
  ProfileText profiles;
  const std::string writer = "<data_writer profile_name=\"linegate/v1/CommandReply\">";
  profiles.set_instances(writer, 240, 16);
  profiles.set(writer, "heartbeatPeriod><nanosec", 100'000);
  profiles.add("<data_reader profile_name=\"linegate/v1/CommandReply\">",
               "<times><heartbeatResponseDelay><sec>600</sec></heartbeatResponseDelay></times>");
  return profiles.text();
}

class BusyHeartbeats : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(gateway.expect("ready").empty());
    ASSERT_FALSE(subscriber.expect("line").empty());
  }
  // Sends requests of `more` new clients, at most 256: the number of instances of a writer of
  // requests.
  void ask_for(int more) {
    Stranger stranger(diagnostics);
    for (const int end = clients + more; clients < end; ++clients) {
      const std::string name = std::to_string(clients);
      ASSERT_TRUE(eventually([&] { return stranger.ask(name, 5) > 0; })) << name;
    }
  }

  const File profiles{busy_heartbeats()};
  Peer gateway{"gateway", profiles.path};
  Peer subscriber{"subscriber", profiles.path};
  std::vector<Diagnostic> diagnostics;
  int clients = 0;
};

TEST_F(BusyHeartbeats, TheWriterOfRepliesIsReplaced) {
  for (int round = 0; round < 5 && !HasFatalFailure(); ++round)
    ask_for(250);
}

TEST_F(BusyHeartbeats, TheGatewayEnds) {
  ask_for(230);
  EXPECT_TRUE(gateway.end());
}

}  // namespace
}  // namespace linegate::test
