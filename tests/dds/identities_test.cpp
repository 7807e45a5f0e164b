// SPDX-License-Identifier: Apache-2.0
// Participants with the identities of `linegate security`: what each role may read and send, who is
// refused, and how the gateway takes the right and the subject of a request from its writer.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>
#include <unistd.h>

#include "bridges/dds/command_samples.h"
#include "bridges/dds/endpoints.h"
#include "bridges/dds/publisher.h"
#include "bridges/dds/writer_partitions.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"

#include "tests/dds/fixtures.h"
#include "tests/dds/late_reader.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

namespace folders = std::filesystem;
using security::Role;
using std::chrono::milliseconds;

constexpr const char* kGateway = "plant";
constexpr const char* kLine = "press";

dds::Security security_of(const folders::path& folder) {
  return dds::security_with(security::files_in(folder.string()));
}

// Answers each command; counts requests by "right subject", and refusals by their reason.
struct Handler : dds::GatewayHandler {
  void on_output_write(dds::OutputMessage message) override { note("output", message.from); }
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_command(dds::CommandMessage message) override {
    note("command", message.from);
    line::Reply reply;
    reply.tag = message.command.tag;
    bridge->reply(reply);
  }
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view why) override {
    ++refused["output " + std::string(why)];
  }
  void on_command_refused(const dds::RequestOrigin& origin, std::uint8_t, line::Refusal,
                          std::string_view why) override {
    ++refused[origin.client + " " + std::string(why)];
  }
  void note(const std::string& what, const dds::Participant& from) {
    ++requests[what + " " + std::string(name(from.right)) + " " + from.subject];
  }

  dds::GatewayBridge* bridge = nullptr;
  std::map<std::string, int> requests;
  std::map<std::string, int> refused;
};

struct Lines : dds::ClientListener {
  void on_line(const dds::Source&, const dds::LineInfo&, const line::LineState&,
               const std::vector<dds::Property>&) override {
    ++received;
  }
  int received = 0;
};

struct Replies : Lines {
  void on_reply(const dds::Target&, const dds::CommandResult& result) override {
    texts.push_back(result.text);
  }
  std::vector<std::string> texts;
};

class Identities : public testing::Test {
 protected:
  Identities() {
    EXPECT_EQ(security::init(plant.string()), "");
    issue(kGateway, Role::gateway);
    issue("alice", Role::operator_);
    issue("erin", Role::engineer);
    issue("victor", Role::viewer);
  }
  ~Identities() override { folders::remove_all(top); }

  void issue(const std::string& name, Role role, std::vector<std::string> lines = {"*/*"}) const {
    EXPECT_EQ(security::issue(plant.string(), {{name, role, std::move(lines)}, 60}), "");
  }
  void start_gateway() {
    dds::GatewayOptions options{kGateway, 1, domain(), paths::kLoopbackProfiles, {kLine, "other"}};
    options.last_words = milliseconds(0);
    options.security = security_of(plant / kGateway);
    options.security.request_partition = security::requests_of_gateway(kGateway);
    options.security.is_holder = security::is_holder;
    options.security.is_revoked = [this](std::string_view right, std::string_view name) {
      return revoked_names.contains(std::string(right) + "/" + std::string(name));
    };
    auto made = dds::GatewayBridge::make(options);
    for (const Diagnostic& diagnostic : made.diagnostics)
      ADD_FAILURE() << to_string(diagnostic);
    ASSERT_TRUE(made.ok());
    bridge = std::move(*made.value);
    handler.bridge = bridge.get();
  }
  static dds::ClientOptions options_of(const folders::path& folder, const std::string& right) {
    dds::ClientOptions options = client_options();
    options.commands = options.outputs = !right.empty();
    options.security = security_of(folder);
    options.security.is_holder = security::is_holder;
    options.security.right = right;
    return options;
  }
  Loaded<std::unique_ptr<dds::Client>> make(const std::string& name, const std::string& right) {
    return dds::Client::make(options_of(plant / name, right));
  }

  void serve(dds::Client& client, dds::ClientListener& listener) {
    bridge->publish({.name = kLine}, known::line_state(), known::at(1));
    bridge->publish({}, known::at(1));
    bridge->poll(milliseconds(2), handler);
    client.poll(milliseconds(2), listener);
  }
  // Makes clients until one receives the line.
  std::unique_ptr<dds::Client> connect(const dds::ClientOptions& options) {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      auto client = make_client(options);
      if (client == nullptr)
        return nullptr;
      Lines lines;
      const auto connected = [&] {
        serve(*client, lines);
        return lines.received != 0;
      };
      if (eventually(connected, kOneAttempt))
        return client;
    }
    return nullptr;
  }
  // Sends that command, and outputs to the same line, until both arrive.
  void send(dds::Client& client, const std::string& from) {
    Lines lines;
    const dds::Target target{kGateway, kLine, 0};
    line::OutputWrite outputs{.group = 1};
    outputs.values.resize(1);
    outputs.values[0].length = 1;
    client.send(target, {.request = line::SdoRead{.node = 5}}, std::chrono::hours(1));
    EXPECT_TRUE(eventually([&] {
      client.write_outputs(target, outputs);
      serve(client, lines);
      return handler.requests["command " + from] != 0 && handler.requests["output " + from] != 0;
    })) << from;
  }

  const folders::path top =
      folders::path(testing::TempDir()) / ("identities-" + std::to_string(::getpid()));
  const folders::path plant = top / "plant";
  std::unique_ptr<dds::GatewayBridge> bridge;
  Handler handler;
  std::set<std::string> revoked_names;  // "operator/alice"
};

TEST_F(Identities, RequestsHaveTheRightAndTheSubjectOfTheirCertificate) {
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  const auto alice = connect(options_of(plant / "alice", "operator/alice"));
  ASSERT_NE(alice, nullptr);
  send(*alice, "operator alice");
  const auto erin = connect(options_of(plant / "erin", "engineer/erin"));
  ASSERT_NE(erin, nullptr);
  send(*erin, "engineer erin");
  EXPECT_EQ(handler.requests.size(), 4U);
  EXPECT_TRUE(handler.refused.empty());
}

// As RequestLifetime: the writer of requests to a line has a partition of its own.
TEST_F(Identities, ARequestOfAGatewayIsNotSentAfterItsLifetime) {
  std::vector<Diagnostic> diagnostics;
  dds::Security security = security_of(plant / kGateway);
  security.request_partition = security::requests_of_gateway(kGateway);
  dds::Endpoints endpoints("reader", domain(), paths::kLoopbackProfiles, diagnostics, true, 0,
                           security);
  LateReader reader(endpoints);
  dds::ClientOptions options = options_of(plant / "erin", "engineer/erin");
  options.outputs = false;
  options.of_gateway = true;
  const dds::Target target{kGateway, kLine, 0};
  std::unique_ptr<dds::Client> client;
  bool is_known = false;
  for (int attempt = 0; attempt < kAttempts && !is_known; ++attempt) {
    client = make_client(options);
    ASSERT_NE(client, nullptr);
    client->prepare(target);
    is_known = eventually([&] { return client->command_peers() > 0; }, kOneAttempt);
  }
  ASSERT_TRUE(is_known);
  reader.expect_fresh_requests_only(*client, target);
}

// The certificate is valid, as one that was issued again. The client repeats what is not answered.
TEST_F(Identities, ARevokedNameIsAnsweredWithTheReasonAndReportedOnce) {
  revoked_names.insert("operator/alice");
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  const auto alice = connect(options_of(plant / "alice", "operator/alice"));
  ASSERT_NE(alice, nullptr);
  Replies replies;
  const dds::Target target{kGateway, kLine, 0};
  alice->send(target, {.request = line::SdoRead{.node = 5}}, std::chrono::hours(1));
  EXPECT_TRUE(eventually([&] {
    serve(*alice, replies);
    return !replies.texts.empty();
  }));
  ASSERT_FALSE(replies.texts.empty());
  EXPECT_NE(replies.texts[0].find("the name of this identity is revoked"), std::string::npos)
      << replies.texts[0];
  ASSERT_EQ(handler.refused.size(), 1U);
  EXPECT_EQ(handler.refused.begin()->second, 1);
  EXPECT_TRUE(handler.requests.empty());
}

// Each line has a reader of its own for outputs.
TEST_F(Identities, OutputsOfALineAreReceivedFromItsAdditionToItsRemoval) {
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  const auto alice = connect(options_of(plant / "alice", "operator/alice"));
  ASSERT_NE(alice, nullptr);
  Lines lines;
  line::OutputWrite outputs{.group = 1};
  outputs.values.resize(1);
  outputs.values[0].length = 1;
  const auto write_for = [&](std::chrono::milliseconds time) {
    handler.requests.clear();
    return eventually(
        [&] {
          alice->write_outputs({kGateway, "late", 0}, outputs);
          serve(*alice, lines);
          return handler.requests["output operator alice"] != 0;
        },
        time);
  };
  EXPECT_FALSE(write_for(milliseconds(500)));
  EXPECT_TRUE(bridge->add_line("late"));
  EXPECT_TRUE(write_for(kOneAttempt));
  bridge->remove_line("late");
  EXPECT_FALSE(write_for(milliseconds(500)));
  EXPECT_TRUE(bridge->add_line("late"));
  EXPECT_TRUE(write_for(kOneAttempt));
}

TEST_F(Identities, AViewerReadsAndSendsNothing) {
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  EXPECT_NE(connect(options_of(plant / "victor", "")), nullptr);
  const auto made = make("victor", "viewer/victor");
  EXPECT_FALSE(made.ok());
  ASSERT_FALSE(made.diagnostics.empty());
  EXPECT_NE(made.diagnostics[0].text.find("does not permit a reader of linegate/v1/CommandReply"),
            std::string::npos)
      << made.diagnostics[0].text;
}

TEST_F(Identities, RightsOfOthersAreRefusedToTheirWriter) {
  for (const char* right : {"engineer/alice", "operator/erin", "operator/alice/more"}) {
    dds::ClientOptions options = options_of(plant / "alice", right);
    options.commands = false;
    const auto client = make_client(options);
    ASSERT_NE(client, nullptr) << right;
    EXPECT_FALSE(client->write_outputs({kGateway, kLine, 0}, {.group = 1})) << right;
    const auto made = make("alice", right);
    EXPECT_FALSE(made.ok()) << right;
    ASSERT_FALSE(made.diagnostics.empty());
    EXPECT_NE(made.diagnostics[0].text.find("does not permit a reader of linegate/v1/CommandReply"),
              std::string::npos)
        << made.diagnostics[0].text;
  }
}

// A program other than Linegate's client, which may read and write whatever its certificate
// permits.
class Program {
 public:
  explicit Program(const folders::path& identity, const std::string& right)
      : endpoints_("program", domain(), paths::kLoopbackProfiles, diagnostics_, true, 0,
                   security_of(identity)),
        requests_(endpoints_.writer_in<v1::CommandRequestPubSubType>(
            dds::request_partition(kGateway, kLine, right), v1::TOPIC_COMMAND_REQUEST)),
        replies_(replies_in(dds::replies_to(right))) {}

  bool ok() const { return requests_ != nullptr && replies_ != nullptr; }
  eprosima::fastdds::dds::DataReader* replies_in(const std::string& partition) {
    return endpoints_.reader_in<v1::CommandReplyPubSubType>(partition, v1::TOPIC_COMMAND_REPLY);
  }
  bool reads_replies_in_the_default_partition() {
    return endpoints_.reader<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY) != nullptr;
  }
  // Changes the partition of the reader that ok() describes.
  void read_replies_in(const std::string& partition) {
    auto* subscriber = const_cast<eprosima::fastdds::dds::Subscriber*>(replies_->get_subscriber());
    eprosima::fastdds::dds::SubscriberQos qos = subscriber->get_qos();
    qos.partition().clear();
    qos.partition().push_back(partition.c_str());
    subscriber->set_qos(qos);
  }
  void send(std::uint64_t id, const std::string& client) {
    v1::CommandRequest request;
    request.gateway(kGateway);
    request.line(kLine);
    request.client(client);
    request.id(id);
    request.last(true);
    dds::to_wire(line::Request(line::NmtRequest{.node = 5}), Duration::zero(), request);
    requests_->write(&request);
  }
  // Takes the replies that have arrived; returns those to all clients by their name.
  const std::map<std::string, int>& replies() {
    v1::CommandReply reply;
    eprosima::fastdds::dds::SampleInfo info;
    while (replies_->take_next_sample(&reply, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data)
        ++received_[reply.client().to_string()];
    }
    return received_;
  }

 private:
  using ReturnCode_t = eprosima::fastrtps::types::ReturnCode_t;

  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_;
  eprosima::fastdds::dds::DataWriter* requests_;
  eprosima::fastdds::dds::DataReader* replies_;
  std::map<std::string, int> received_;
};

// Neither by another reader, nor by one that changes its partition after it was matched.
TEST_F(Identities, EachIdentityReadsTheRepliesToItselfOnly) {
  issue("bob", Role::operator_);
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  std::unique_ptr<Program> bob;
  std::uint64_t id = 0;
  const auto connected = [&] {
    bob->send(++id, "bob");
    bridge->poll(milliseconds(20), handler);
    return !bob->replies().empty();
  };
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    bob = std::make_unique<Program>(plant / "bob", "operator/bob");
    ASSERT_TRUE(bob->ok());
    if (eventually(connected, kOneAttempt))
      break;
  }
  ASSERT_FALSE(bob->replies().empty());
  for (const char* partition : {"*", "plant/*", "*/*/operator/*", "*/*/operator/alice",
                                "plant//operator/alice", "*/*/operator/bo?"})
    EXPECT_EQ(bob->replies_in(partition), nullptr) << partition;
  EXPECT_FALSE(bob->reads_replies_in_the_default_partition());

  const auto alice = connect(options_of(plant / "alice", "operator/alice"));
  ASSERT_NE(alice, nullptr);
  Lines lines;
  const auto is_answered = [&] {
    bool answered = false;
    struct Answer : dds::ClientListener {
      explicit Answer(bool& it) : answered_(it) {}
      void on_reply(const dds::Target&, const dds::CommandResult&) override { answered_ = true; }
      bool& answered_;
    } answer(answered);
    alice->send({kGateway, kLine, 0}, {.request = line::SdoRead{.node = 5}}, kDeadline);
    return eventually([&] {
      bob->replies();
      serve(*alice, answer);
      return answered;
    });
  };
  EXPECT_TRUE(is_answered());
  // The library does not check a change of partitions, but the gateway checks its announcement.
  for (const char* partition : {"*", "*/*/operator/alice", "plant//operator/alice"}) {
    bob->read_replies_in(partition);
    for (int i = 0; i < 10; ++i)
      EXPECT_TRUE(is_answered());
  }
  for (int i = 0; i < 50; ++i)
    serve(*alice, lines);
  ASSERT_EQ(bob->replies().size(), 1U);
  EXPECT_EQ(bob->replies().begin()->first, "bob");
}

// The permissions of each gateway allow it to publish; the name in a sample is a member.
TEST_F(Identities, AGatewayPublishesInItsOwnNameOnly) {
  issue("hall", Role::gateway);
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  const auto victor = connect(options_of(plant / "victor", ""));
  ASSERT_NE(victor, nullptr);
  EXPECT_EQ(victor->foreign_samples(), 0U);
  struct Sources : dds::ClientListener {
    void on_line(const dds::Source& source, const dds::LineInfo&, const line::LineState&,
                 const std::vector<dds::Property>&) override {
      lines.insert(source.gateway + "/" + source.line);
    }
    void on_event(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view,
                  const std::vector<dds::Property>&) override {
      events.emplace(source.gateway, event.number);
    }
    std::set<std::string> lines;
    std::set<std::pair<std::string, std::uint64_t>> events;
  } sources;
  const auto forged = [&](dds::Endpoints& hall) {
    auto* const lines = hall.writer<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE);
    auto* const events = hall.writer<v1::EventPubSubType>(v1::TOPIC_EVENT);
    auto* const images = hall.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
    return eventually(
        [&] {
          for (const char* gateway : {kGateway, "hall"}) {
            v1::LineState line;
            line.gateway(gateway);
            line.line("forged");
            lines->write(&line);
            v1::Event event;
            event.gateway(gateway);
            event.line("forged");
            event.number(77);
            events->write(&event);
            v1::ProcessImage image;
            image.gateway(gateway);
            image.line("forged");
            images->write(&image);
          }
          serve(*victor, sources);
          return sources.lines.contains("hall/forged") && sources.events.contains({"hall", 77U}) &&
                 victor->foreign_samples() >= 3;
        },
        kOneAttempt);
  };
  bool arrived = false;
  for (int attempt = 0; attempt < kAttempts && !arrived; ++attempt) {
    std::vector<Diagnostic> diagnostics;
    dds::Endpoints hall("linegate hall", domain(), paths::kLoopbackProfiles, diagnostics, true, 0,
                        security_of(plant / "hall"));
    ASSERT_TRUE(hall.ok());
    arrived = forged(hall);
  }
  EXPECT_TRUE(arrived);
  EXPECT_FALSE(sources.lines.contains("plant/forged"));
  EXPECT_FALSE(sources.events.contains({kGateway, 77U}));
}

// What a gateway receives of the lines that it follows.
struct Followed : dds::GatewayHandler {
  void on_output_write(dds::OutputMessage) override {}
  void on_command(dds::CommandMessage) override {}
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}
  void on_remote_state(const dds::RemoteSource& source, std::int64_t) override {
    incarnations.insert(source.incarnation);
  }
  void on_remote_layout(const dds::RemoteSource& source, const image::Layout&) override {
    incarnations.insert(source.incarnation);
  }
  void on_remote_image(const dds::RemoteSource& source, const image::Snapshot&) override {
    incarnations.insert(source.incarnation);
    ++images;
  }
  void on_unreadable(std::uint64_t samples) override { dropped += samples; }

  std::set<std::uint64_t> incarnations;
  int images = 0;
  std::uint64_t dropped = 0;
};

// A gateway with its own certificate in the name of another one, whose lines are followed.
class Forger {
 public:
  Forger(const folders::path& identity, std::uint64_t incarnation)
      : endpoints_("linegate other", domain(), paths::kLoopbackProfiles, diagnostics_, true, 0,
                   security_of(identity)) {
    state_.gateway("hall");
    state_.line(kLine);
    state_.incarnation(incarnation);
    image_.gateway("hall");
    image_.line(kLine);
    image_.incarnation(incarnation);
  }
  void write() {
    states_->write(&state_);
    images_->write(&image_);
  }

 private:
  std::vector<Diagnostic> diagnostics_;
  dds::Endpoints endpoints_;
  eprosima::fastdds::dds::DataWriter* const states_ =
      endpoints_.writer<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE);
  eprosima::fastdds::dds::DataWriter* const images_ =
      endpoints_.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
  v1::LineState state_;
  v1::ProcessImage image_;
};

// `forward:` from a line of another gateway.
TEST_F(Identities, AGatewayFollowsTheHolderOfTheNameOnly) {
  constexpr std::uint64_t kForged = 66;
  constexpr std::uint64_t kTrue = 5;
  issue("hall", Role::gateway);
  issue("other", Role::gateway);
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  ASSERT_TRUE(bridge->follow({{"hall", kLine}}));
  Followed received;
  std::unique_ptr<Forger> forger;
  const auto is_dropped = [&] {
    forger->write();
    bridge->poll(milliseconds(10), received);
    return received.dropped > 1;
  };
  for (int attempt = 0; attempt < kAttempts && received.dropped < 2; ++attempt) {
    forger = std::make_unique<Forger>(plant / "other", kForged);
    eventually(is_dropped, kOneAttempt);
  }
  ASSERT_GT(received.dropped, 1U) << "the forged samples do not arrive, so that nothing is shown";

  dds::GatewayOptions options{"hall", kTrue, domain(), paths::kLoopbackProfiles, {kLine}};
  options.last_words = milliseconds(0);
  options.security = security_of(plant / "hall");
  options.security.request_partition = security::requests_of_gateway("hall");
  std::unique_ptr<dds::GatewayBridge> hall;
  const auto arrives = [&] {
    hall->publish({.name = kLine}, known::line_state(), known::at(1));
    hall->publish(kLine, known::layout());
    hall->publish(kLine, known::snapshot());
    return is_dropped() && received.images != 0;
  };
  for (int attempt = 0; attempt < kAttempts && received.images == 0; ++attempt) {
    hall.reset();
    auto made = dds::GatewayBridge::make(options);
    ASSERT_TRUE(made.ok());
    hall = std::move(*made.value);
    eventually(arrives, kOneAttempt);
  }
  EXPECT_GT(received.images, 0);
  EXPECT_EQ(received.incarnations, std::set<std::uint64_t>{kTrue});

  // Its participant is still matched, so that its samples arrive.
  revoked_names.insert("gateway/hall");
  received.incarnations.clear();
  received.images = 0;
  EXPECT_FALSE(eventually(arrives, milliseconds(1'000)));
  EXPECT_TRUE(received.incarnations.empty());
  revoked_names.clear();
  EXPECT_TRUE(eventually(arrives));
}

TEST_F(Identities, AnIdentityOfOneLineSendsToNoOther) {
  issue("lena", Role::operator_, {"plant/press", "plant/"});
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  const auto lena = connect(options_of(plant / "lena", "operator/lena"));
  ASSERT_NE(lena, nullptr);
  send(*lena, "operator lena");
  line::OutputWrite outputs{.group = 1};
  EXPECT_FALSE(lena->write_outputs({kGateway, "other", 0}, outputs));
  Lines lines;
  const auto result =
      lena->call({kGateway, "other", 0}, {.request = line::SdoRead{}}, kDeadline, lines);
  EXPECT_EQ(result.reply.error, line::to_error(line::Refusal::not_permitted));
}

// What a program other than Linegate's client may announce: its permissions have patterns, so a
// partition with wildcards or further parts satisfies them.
TEST_F(Identities, PartitionsThatAreNotOfTheLineAreRefused) {
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  const std::vector<std::string> partitions{"plant/*/operator/alice", "plant/pr?ss/operator/alice",
                                            "plant/press/engineer/erin/operator/alice",
                                            "plant/other/operator/alice"};
  bool connected = false;
  for (int attempt = 0; attempt < kAttempts && !connected; ++attempt) {
    std::vector<Diagnostic> diagnostics;
    dds::Endpoints endpoints("alice", domain(), paths::kLoopbackProfiles, diagnostics, true, 0,
                             security_of(plant / "alice"));
    ASSERT_TRUE(endpoints.ok());
    std::vector<eprosima::fastdds::dds::DataWriter*> writers;
    for (const std::string& partition : partitions) {
      writers.push_back(
          endpoints.writer_in<v1::CommandRequestPubSubType>(partition, v1::TOPIC_COMMAND_REQUEST));
      ASSERT_NE(writers.back(), nullptr) << partition;
    }
    std::uint64_t id = 0;
    const auto all_refused = [&] {
      for (std::size_t i = 0; i < writers.size(); ++i) {
        v1::CommandRequest request;
        request.gateway(kGateway);
        request.line(kLine);
        request.client(partitions[i]);
        request.id(++id);
        request.last(true);
        dds::to_wire(line::Request(line::NmtRequest{.node = 5}), Duration::zero(), request);
        writers[i]->write(&request);
      }
      bridge->poll(milliseconds(20), handler);
      return handler.refused.size() == partitions.size();
    };
    connected = eventually(all_refused, kOneAttempt);
  }
  EXPECT_TRUE(connected);
  for (const std::string& partition : partitions) {
    EXPECT_NE(handler.refused[partition + " its writer has no right to send requests to this line"],
              0)
        << partition;
  }
  EXPECT_TRUE(handler.requests.empty());
}

// Each is refused while an identity of the plant is served.
TEST_F(Identities, RoguesAreRefused) {
  const folders::path other = top / "other";
  ASSERT_EQ(security::init(other.string()), "");
  ASSERT_EQ(security::issue(other.string(), {{"alice", Role::operator_}, 60}), "");
  issue("roger", Role::operator_);
  const folders::path revoked = top / "revoked";
  folders::copy(plant / "roger", revoked);  // still has the list without its own certificate
  ASSERT_EQ(security::revoke(plant.string(), "roger"), "");
  ASSERT_NO_FATAL_FAILURE(start_gateway());
  dds::ClientOptions plain = client_options();
  plain.commands = false;
  std::vector<std::unique_ptr<dds::Client>> rogues;
  for (const dds::ClientOptions& options : {options_of(other / "alice", "operator/alice"),
                                            options_of(revoked, "operator/roger"), plain}) {
    rogues.push_back(make_client(options));
    ASSERT_NE(rogues.back(), nullptr);
  }
  Lines of_rogues;
  for (int served = 0; served < 2; ++served) {
    const auto alice = connect(options_of(plant / "alice", "operator/alice"));
    ASSERT_NE(alice, nullptr);
    for (const auto& rogue : rogues) {
      rogue->send({kGateway, kLine, 0}, {.request = line::SdoRead{}}, kDeadline);
      for (int i = 0; i < 50; ++i)
        serve(*rogue, of_rogues);
    }
    send(*alice, "operator alice");
  }
  EXPECT_EQ(of_rogues.received, 0);
  EXPECT_EQ(handler.requests.size(), 2U) << "of alice: commands and outputs";
}

TEST_F(Identities, AnExpiredCertificateIsNoParticipant) {
  const folders::path expired = top / "expired";
  folders::copy(plant / "alice", expired);
  const std::string command =
      "cd '" + expired.string() +
      "' && openssl req -new -key identity.key -subj /O=linegate/OU=operator/CN=alice -out csr && "
      "openssl x509 -req -in csr -CA ca.crt -CAkey '" +
      (plant / "ca.key").string() + "' -set_serial 7 -days -1 -sha256 -out identity.crt";
  ASSERT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0);
  const auto made = dds::Client::make(options_of(expired, "operator/alice"));
  EXPECT_FALSE(made.ok());
  ASSERT_FALSE(made.diagnostics.empty());
  EXPECT_NE(made.diagnostics[0].text.find("(linegate security check)"), std::string::npos);
}

TEST(WriterPartitions, AWriterThatChangesThemHasNone) {
  dds::WriterPartitions writers;
  const dds::guard::Guid writer{1};
  EXPECT_FALSE(writers.of(writer));
  writers.note(writer, {"plant/press/operator/alice"});
  writers.note(writer, {"plant/press/operator/alice"});
  EXPECT_TRUE(writers.of(writer));
  writers.note(writer, {"plant/press/engineer/alice"});
  EXPECT_FALSE(writers.of(writer));
  writers.note(writer, {"plant/press/operator/alice"});
  EXPECT_FALSE(writers.of(writer)) << "samples of both may be unread";
  writers.forget(writer);
  writers.note(writer, {"plant/press/operator/alice"});
  EXPECT_TRUE(writers.of(writer));
}

// A program that writes a sample and ends.
TEST(WriterPartitions, OfAWriterThatHasGoneRemainForItsLastSamples) {
  dds::WriterPartitions writers;
  const dds::guard::Guid writer{1};
  writers.note(writer, {"plant/press/operator/alice"});
  writers.forget(writer);
  EXPECT_TRUE(writers.of(writer));
  dds::guard::Guid other{2};
  for (std::size_t i = 0; i < dds::WriterPartitions::kMostGone; ++i) {
    other[1] = static_cast<std::uint8_t>(i);
    writers.note(other, {"plant/press/operator/bob"});
    writers.forget(other);
  }
  EXPECT_FALSE(writers.of(writer));
  EXPECT_TRUE(writers.of(other));
  writers.note(other, {"plant/press/engineer/bob"});
  EXPECT_TRUE(writers.of(other)) << "a new writer with the same GUID";
}

TEST(WriterPartitions, AreBounded) {
  dds::WriterPartitions writers;
  dds::guard::Guid writer{};
  for (std::size_t i = 0; i <= dds::WriterPartitions::kMost; ++i) {
    writer[0] = static_cast<std::uint8_t>(i);
    writer[1] = static_cast<std::uint8_t>(i >> 8U);
    writers.note(writer, {"plant/press/operator/alice"});
  }
  EXPECT_FALSE(writers.of(writer));
}

}  // namespace
}  // namespace linegate::test
