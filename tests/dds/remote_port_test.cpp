// SPDX-License-Identifier: Apache-2.0
// A gateway whose DDS process lies: it sends any message at any time.
#include "bridges/dds/remote_port.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <linegate.h>

#include "bridges/dds/port_codec.h"
#include "bridges/named/device_types.h"
#include "bridges/named/group_types.h"
#include "bridges/named/sample_plan.h"

#include "tests/bridges/named/layouts.h"

namespace linegate::dds {
namespace {

using namespace std::chrono_literals;

// What the gateway and its process exchange, outside of the link so that a test can access it.
struct Wire {
  ProcessNumber process = 1;
  std::deque<PortMessage> to_gateway;
  std::vector<PortMessage> to_process;  // of the present process
  std::vector<std::string> rejected;
  std::vector<std::string> logged;
  std::vector<std::string> replaced;
  bool no_room_for_files = false;
  std::vector<std::pair<std::uint64_t, std::shared_ptr<SharedFiles>>> shared;  // by tag

  void send(PortMessage message) { to_gateway.push_back(std::move(message)); }
  void send_answer() {
    PortMessage message;
    encode(FromEndpoints::ready, std::vector<Diagnostic>{}, message);
    send(message);
  }
  void restart() {
    ++process;
    to_gateway.clear();
    to_process.clear();
  }
  int count(ToEndpoints kind) const {
    int out = 0;
    for (const PortMessage& message : to_process)
      out += kind_of(message) == static_cast<std::uint8_t>(kind) ? 1 : 0;
    return out;
  }
};

class FakeLink final : public MessageLink {
 public:
  explicit FakeLink(Wire& wire) : wire_(wire) {}
  ProcessNumber process() const override { return wire_.process; }
  bool send(ProcessNumber process, std::span<const std::byte> message) override {
    if (process != wire_.process)
      return false;
    wire_.to_process.emplace_back(message.begin(), message.end());
    return true;
  }
  bool share(ProcessNumber process, std::uint64_t tag,
             const std::shared_ptr<SharedFiles>& files) override {
    if (process != wire_.process || wire_.no_room_for_files)
      return false;
    wire_.shared.emplace_back(tag, files);
    return true;
  }
  Positions positions(ProcessNumber) override {
    return {wire_.to_process.size(), wire_.to_process.size()};
  }
  ProcessNumber receive(std::vector<std::byte>& message) override {
    if (wire_.to_gateway.empty())
      return 0;
    message = std::move(wire_.to_gateway.front());
    wire_.to_gateway.pop_front();
    return wire_.process;
  }
  void wait(Duration) override {}
  void wake() override {}
  void reject(ProcessNumber, std::string_view reason) override {
    wire_.rejected.emplace_back(reason);
  }
  void replace(ProcessNumber process, std::string_view reason) override {
    wire_.replaced.push_back(std::to_string(process) + " " + std::string(reason));
  }
  void log(Severity, std::string_view text) override { wire_.logged.emplace_back(text); }
  void finish(Duration) override { wire_.process = 0; }

 private:
  Wire& wire_;
};

bool never() {
  return false;
}

struct Received final : GatewayHandler {
  void on_output_write(OutputMessage message) override { outputs.push_back(std::move(message)); }
  void on_command(CommandMessage message) override { commands.push_back(std::move(message)); }
  void on_gateway_command(GatewayCommandMessage) override {}
  void on_output_refused(const RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}
  void on_misfit(std::string_view, std::string_view policy) override {
    misfits.emplace_back(policy);
  }

  void on_remote_state(const RemoteSource& source, std::int64_t time) override {
    remote.push_back(source.line.gateway + ' ' + source.line.line + " state " +
                     std::to_string(time));
  }
  void on_remote_layout(const RemoteSource& source, const image::Layout& layout) override {
    remote.push_back(source.line.gateway + ' ' + source.line.line + " layout " +
                     std::to_string(layout.id));
  }
  void on_remote_image(const RemoteSource& source, const image::Snapshot& image) override {
    remote.push_back(source.line.gateway + ' ' + source.line.line + " image " +
                     std::to_string(image.layout_id));
  }

  std::vector<std::string> remote;  // samples of other gateways
  std::vector<OutputMessage> outputs;
  std::vector<CommandMessage> commands;
  std::vector<std::string> misfits;
};

class RemotePortTest : public testing::Test {
 protected:
  void SetUp() override {
    wire_.send_answer();
    auto made = make_remote_bridge({.gateway = "g", .incarnation = 1, .lines = {"line"}},
                                   std::make_unique<FakeLink>(wire_), 5s, never);
    ASSERT_TRUE(made.ok());
    bridge_ = std::move(*made.value);
  }
  static PortMessage request(std::uint8_t client, std::uint64_t id) {
    v1::CommandRequest sample;
    sample.gateway("g");
    sample.line("line");
    sample.client("client " + std::to_string(client));
    sample.id(id);
    sample.kind(static_cast<std::uint8_t>(v1::COMMAND_LOCAL_READ));
    sample.index(0x1000);
    sample.timeout_ns(1'000'000'000);
    sample.last(true);
    Participant from{.host = "panel" + std::to_string(client)};
    from.prefix.fill(client);
    PortMessage message;
    encode_received(FromEndpoints::command_request, from, sample, message);
    return message;
  }
  void poll() {
    for (int i = 0; i < 20; ++i)
      bridge_->poll(0s, received_);
  }

  Wire wire_;
  std::unique_ptr<GatewayBridge> bridge_;
  Received received_;
};

TEST_F(RemotePortTest, ARequestHasTheSenderThatItsMessageStates) {
  wire_.send(request(1, 1));
  wire_.send(request(2, 1));
  poll();
  ASSERT_EQ(received_.commands.size(), 2U);
  for (std::uint8_t client = 1; client <= 2; ++client) {
    const Participant& from = received_.commands[client - 1U].from;
    EXPECT_EQ(from.prefix[0], client);
    EXPECT_EQ(from.host, "panel" + std::to_string(client));
  }
  EXPECT_TRUE(wire_.rejected.empty());
}

TEST_F(RemotePortTest, ARequestThatANewProcessReceivesAgainIsCarriedOutOnce) {
  wire_.send(request(1, 1));
  poll();
  wire_.restart();
  wire_.send_answer();
  wire_.send(request(1, 1));
  poll();
  EXPECT_EQ(received_.commands.size(), 1U);
  EXPECT_TRUE(wire_.rejected.empty());
}

TEST_F(RemotePortTest, ANewProcessReceivesTheOptionsFirstAndEverythingAgain) {
  Event event;
  for (event.number = 1; event.number <= 3; ++event.number)
    bridge_->publish("line", event, "text");
  poll();
  ASSERT_EQ(wire_.count(ToEndpoints::event), 3);
  for (int restarts = 0; restarts < 3; ++restarts) {
    wire_.restart();
    wire_.send_answer();
    poll();
    ASSERT_FALSE(wire_.to_process.empty());
    EXPECT_EQ(kind_of(wire_.to_process[0]), static_cast<std::uint8_t>(ToEndpoints::configure));
    EXPECT_EQ(wire_.count(ToEndpoints::configure), 1);
    EXPECT_EQ(wire_.count(ToEndpoints::event), 3);
  }
  EXPECT_EQ(wire_.logged.size(), 3U) << "one entry for each start";
}

TEST_F(RemotePortTest, EachProcessReceivesTheMemoryOfALineAfterItsLayoutAndBeforeItsMessage) {
  image::Layout layout;
  layout.id = 1;
  const auto files = std::make_shared<SharedFiles>();
  wire_.no_room_for_files = true;
  bridge_->publish("line", layout);
  EXPECT_TRUE(bridge_->share_images("line", files));
  poll();
  EXPECT_EQ(wire_.count(ToEndpoints::share_images), 0) << "not without its memory";
  wire_.no_room_for_files = false;
  for (int restarts = 0; restarts < 3; ++restarts) {
    poll();
    ASSERT_EQ(wire_.shared.size(), 1U);
    EXPECT_EQ(wire_.shared[0].second, files);
    ASSERT_EQ(wire_.count(ToEndpoints::share_images), 1);
    EXPECT_EQ(wire_.count(ToEndpoints::image_layout), 1);
    const auto shared = decode_shared_images(wire_.to_process.back());
    ASSERT_TRUE(shared) << "it is the last one";
    EXPECT_EQ(shared->line, "line");
    EXPECT_EQ(shared->tag, wire_.shared[0].first);
    wire_.shared.clear();
    wire_.restart();
    wire_.send_answer();
  }
  bridge_->remove_line("line");
  wire_.restart();
  wire_.send_answer();
  poll();
  EXPECT_TRUE(wire_.shared.empty());
  EXPECT_EQ(wire_.count(ToEndpoints::share_images), 0);
}

TEST_F(RemotePortTest, AProcessThatIsReplacedIsAskedToEndAndItsSuccessorIsNot) {
  EXPECT_TRUE(bridge_->replace_process("revoked"));
  EXPECT_EQ(wire_.count(ToEndpoints::stop), 1);
  EXPECT_EQ(wire_.replaced, std::vector<std::string>{"1 revoked"});
  wire_.restart();
  EXPECT_FALSE(bridge_->replace_process("again")) << "it has not answered yet";
  wire_.send_answer();
  poll();
  EXPECT_EQ(wire_.count(ToEndpoints::configure), 1);
  EXPECT_EQ(wire_.count(ToEndpoints::stop), 0);
  EXPECT_TRUE(bridge_->replace_process("again"));
  EXPECT_EQ(wire_.replaced.back(), "2 again");
}

TEST_F(RemotePortTest, AProcessThatAnswersTheOptionsTwiceIsReplacedAndNotLogged) {
  for (int i = 0; i < 1'000; ++i)
    wire_.send_answer();
  poll();
  EXPECT_FALSE(wire_.rejected.empty());
  EXPECT_TRUE(wire_.logged.empty());
}

TEST_F(RemotePortTest, ASampleBeforeTheAnswerIsNotAccepted) {
  wire_.restart();
  wire_.send(request(1, 1));
  poll();
  EXPECT_EQ(wire_.rejected.size(), 1U);
  EXPECT_TRUE(received_.commands.empty());
}

TEST_F(RemotePortTest, AProcessThatLiesFromItsStartDoesNotKeepTheGatewayBusy) {
  Wire wire;
  for (int i = 0; i < 100; ++i)
    wire.send(request(1, 1));
  wire.send_answer();
  const auto made = make_remote_bridge({.gateway = "g", .incarnation = 1},
                                       std::make_unique<FakeLink>(wire), 5s, never);
  EXPECT_TRUE(made.ok());
  EXPECT_EQ(wire.rejected.size(), 100U);
}

TEST_F(RemotePortTest, AProcessThatNeverAnswersDoesNotStopTheGateway) {
  Wire wire;
  const auto made = make_remote_bridge({.gateway = "g", .incarnation = 1, .lines = {"line"}},
                                       std::make_unique<FakeLink>(wire), 1ms, never);
  ASSERT_TRUE(made.ok());
  EXPECT_TRUE(made.diagnostics.empty());
  ASSERT_EQ(wire.logged.size(), 1U);
  EXPECT_NE(wire.logged[0].find("the lines start without DDS"), std::string::npos);
  (*made.value)->publish("line", Event{.number = 1}, "text");
  wire.restart();
  wire.send_answer();
  (*made.value)->poll(0s, received_);
  EXPECT_EQ(wire.count(ToEndpoints::event), 1);
  ASSERT_EQ(wire.logged.size(), 2U);
  EXPECT_EQ(wire.logged[1], "the DDS process runs");
  EXPECT_EQ((*made.value)->process_starts(), 2U);
}

TEST_F(RemotePortTest, AStopEndsTheWaitForTheFirstAnswer) {
  Wire wire;
  int calls = 0;
  EXPECT_TRUE(make_remote_bridge({.gateway = "g", .incarnation = 1},
                                 std::make_unique<FakeLink>(wire), 1h, [&] { return ++calls == 3; })
                  .ok());
  EXPECT_EQ(calls, 3);
  EXPECT_TRUE(wire.logged.empty());
}

TEST_F(RemotePortTest, OnlyAnErrorThatTheProcessReportsStopsTheGateway) {
  const auto make = [](std::vector<Diagnostic> diagnostics, Wire& wire) {
    PortMessage message;
    encode(FromEndpoints::failed, diagnostics, message);
    wire.send(message);
    return make_remote_bridge({.gateway = "g", .incarnation = 1}, std::make_unique<FakeLink>(wire),
                              1ms, never);
  };
  Wire with_error;
  const auto failed = make({{Severity::error, "profile.xml", 1, 1, "bad"}}, with_error);
  EXPECT_FALSE(failed.value);
  ASSERT_EQ(failed.diagnostics.size(), 1U);
  EXPECT_EQ(failed.diagnostics[0].text, "bad");
  Wire without;
  EXPECT_TRUE(make({}, without).ok());
  EXPECT_EQ(without.rejected.size(), 1U);
}

TEST_F(RemotePortTest, AnErrorAfterTheStartOfTheLinesIsLogged) {
  wire_.restart();
  PortMessage message;
  encode(FromEndpoints::failed,
         std::vector<Diagnostic>{{Severity::error, "profile.xml", 1, 1, "bad"}}, message);
  wire_.send(message);
  poll();
  ASSERT_EQ(wire_.logged.size(), 1U);
  EXPECT_NE(wire_.logged[0].find("bad"), std::string::npos);
  EXPECT_TRUE(wire_.rejected.empty());
}

TEST_F(RemotePortTest, AMalformedSenderOrSampleIsNotAccepted) {
  PortMessage bad_host = request(1, 1);
  bad_host[kMessageHead + 15] = std::byte{0xFF};  // its length
  wire_.send(bad_host);
  PortMessage longer = request(1, 2);
  longer.push_back(std::byte{0});
  wire_.send(longer);
  wire_.send(PortMessage{});
  wire_.send(PortMessage(8));
  wire_.send(PortMessage(8, std::byte{0xFF}));
  poll();
  EXPECT_EQ(wire_.rejected.size(), 5U);
  EXPECT_TRUE(received_.commands.empty());
}

template <class Sample>
PortMessage of_line(FromEndpoints kind, const std::string& gateway, Sample sample) {
  sample.gateway(gateway);
  sample.line("press");
  sample.incarnation(7);
  PortMessage message;
  encode_sample(static_cast<std::uint8_t>(kind), sample, message);
  return message;
}

PortMessage state_of(const std::string& gateway, std::int64_t time) {
  v1::LineState sample;
  sample.time(time);
  return of_line(FromEndpoints::line_state, gateway, sample);
}

TEST_F(RemotePortTest, EachProcessReceivesWhichLinesAreFollowedAndSendsThem) {
  EXPECT_TRUE(bridge_->follow({{"hall-b", "press"}, {"g", "own"}}));
  poll();
  wire_.restart();
  wire_.send_answer();
  poll();
  ASSERT_EQ(wire_.count(ToEndpoints::follow), 1);
  EXPECT_EQ(decode_follow(wire_.to_process.back()), (std::vector<RemoteLine>{{"hall-b", "press"}}))
      << "not the own gateway";
  v1::ImageLayout layout;
  layout.parts(1);
  layout.layout_id(5);
  v1::ProcessImage image;
  image.layout_id(5);
  wire_.send(state_of("hall-b", 1));
  wire_.send(of_line(FromEndpoints::process_image, "hall-b", image));
  wire_.send(of_line(FromEndpoints::image_layout, "hall-b", layout));
  image.direction(v1::DIRECTION_OUTPUTS);
  wire_.send(of_line(FromEndpoints::process_image, "hall-b", image));
  wire_.send(state_of("hall-b", 2));
  poll();
  EXPECT_EQ(received_.remote,
            (std::vector<std::string>{"hall-b press state 1", "hall-b press image 5",
                                      "hall-b press layout 5", "hall-b press state 2"}));
  EXPECT_TRUE(wire_.rejected.empty());
}

TEST_F(RemotePortTest, LinesThatAreNotFollowedDelayNothing) {
  for (int i = 0; i < 3; ++i) {
    wire_.send(state_of("hall-c", i));
    wire_.send(request(1, 1 + static_cast<std::uint64_t>(i)));
  }
  poll();
  EXPECT_TRUE(received_.remote.empty());
  EXPECT_EQ(received_.commands.size(), 3U);
  wire_.send(PortMessage(9, std::byte{static_cast<std::uint8_t>(FromEndpoints::line_state)}));
  PortMessage longer = state_of("hall-b", 1);
  longer.push_back(std::byte{0});
  wire_.send(longer);
  poll();
  EXPECT_EQ(wire_.rejected.size(), 2U);
}

TEST_F(RemotePortTest, OnlyTheNameOfAPolicyIsAMisfit) {
  PortMessage message;
  encode(FromEndpoints::command_misfit, "ownership", message);
  wire_.send(message);
  poll();
  EXPECT_EQ(received_.misfits, std::vector<std::string>{"ownership"});
  encode(FromEndpoints::command_misfit, "x\n\x1b[2J", message);
  wire_.send(message);
  poll();
  EXPECT_EQ(received_.misfits.size(), 1U);
  EXPECT_EQ(wire_.rejected.size(), 1U);
}

// Two devices of the line, each with a type.
std::vector<named::DeviceType> two_types(std::uint16_t index = 0x2000) {
  const image::Layout layout = named::layout_of(
      {{.name = "ram.A", .type = od::DataType::unsigned8, .node = 5, .index = index},
       {.name = "axis.A", .type = od::DataType::unsigned8, .node = 6}});
  return named::device_types("line", layout).types;
}

class NamedPortTest : public RemotePortTest {
 protected:
  void SetUp() override {
    RemotePortTest::SetUp();
    bridge_->watch_readers([this] { ++changes_; });
    types_ = two_types();
    ASSERT_TRUE(bridge_->set_named_types("line", image::Direction::inputs, types_));
    poll();
    changes_ = 0;
  }
  void report(std::uint32_t topic, bool present) {
    PortMessage message;
    encode(NamedReadersMessage{topic, present}, message);
    wire_.send(message);
  }
  static image::Snapshot snapshot() {
    image::Snapshot out;
    out.bytes = {std::byte{0x5A}, std::byte{0xA5}};
    out.valid = {3};
    return out;
  }
  bool publish(std::size_t type, std::uint64_t number) {
    return bridge_->publish(types_[type], snapshot(), number, std::vector<Instant>(1));
  }
  // The sample that this publishes.
  std::vector<std::byte> written(std::size_t type, std::uint64_t number) const {
    const named::SamplePlan plan(types_[type], "g");
    std::vector<std::byte> out(plan.max_size());
    const std::vector<std::int64_t> times{ClockMap{}.utc(Instant{})};
    out.resize(plan.write({.incarnation = 1,
                           .sequence_number = number,
                           .time = ClockMap{}.utc(snapshot().acquired),
                           .clock = static_cast<std::uint8_t>(ClockMap{}.quality),
                           .pdo_times = times},
                          snapshot(), out));
    return out;
  }
  std::vector<NumberedTopic> declared(ToEndpoints kind = ToEndpoints::named_topic) const {
    std::vector<NumberedTopic> out;
    for (const PortMessage& message : wire_.to_process) {
      if (kind_of(message) == static_cast<std::uint8_t>(kind))
        out.push_back(decode_numbered_topic(message).value());
    }
    return out;
  }

  std::vector<named::DeviceType> types_;
  int changes_ = 0;  // calls of the function of watch_readers()
};

TEST_F(NamedPortTest, EachProcessReceivesTheTopicsAndNoOldSample) {
  for (std::uint32_t starts = 1; starts <= 3; ++starts) {
    const auto topics = declared();
    ASSERT_EQ(topics.size(), 2U);
    EXPECT_EQ(topics[0].number, 1U);
    EXPECT_EQ(topics[0].topic.line, "line");
    EXPECT_EQ(topics[0].topic.topic, "plant/line/ram/inputs");
    EXPECT_EQ(topics[0].topic.type, types_[0].type_name());
    EXPECT_GT(topics[0].topic.max_size, 0U);
    EXPECT_FALSE(topics[0].topic.key.empty());
    EXPECT_EQ(topics[1].number, 2U);
    EXPECT_EQ(topics[1].topic.topic, "plant/line/axis/inputs");
    EXPECT_FALSE(bridge_->has_readers(types_[0]));
    report(1, true);
    poll();
    EXPECT_TRUE(bridge_->has_readers(types_[0]));
    EXPECT_FALSE(bridge_->has_readers(types_[1]));
    EXPECT_TRUE(bridge_->accepts_named(types_[0]));
    ASSERT_TRUE(publish(0, starts));
    ASSERT_EQ(wire_.count(ToEndpoints::named_sample), 1);
    const auto sample = decode_named_sample(wire_.to_process.back());
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->topic, 1U);
    EXPECT_LE(sample->sample.size(), topics[0].topic.max_size);
    EXPECT_TRUE(std::ranges::equal(sample->sample, written(0, starts)))
        << "as without a second process";
    wire_.restart();
    wire_.send_answer();
    poll();
    EXPECT_EQ(wire_.count(ToEndpoints::named_sample), 0);
  }
  EXPECT_TRUE(wire_.rejected.empty());
}

TEST_F(NamedPortTest, AnotherTypeHasAnotherNumberAndOneThatRemainsKeepsIt) {
  types_ = two_types(0x2001);
  ASSERT_TRUE(bridge_->set_named_types("line", image::Direction::inputs, types_));
  ASSERT_EQ(declared().size(), 3U);
  EXPECT_EQ(declared()[2].number, 3U);
  EXPECT_EQ(declared()[2].topic.topic, "plant/line/ram/inputs");
  ASSERT_EQ(wire_.count(ToEndpoints::end_topics), 1);
  const PortMessage& before = wire_.to_process[wire_.to_process.size() - 2];
  EXPECT_EQ(decode_topics(before), std::vector<std::uint32_t>{1});
  report(1, true);  // late
  poll();
  EXPECT_FALSE(bridge_->has_readers(types_[0]));
  report(2, true);
  report(3, true);
  poll();
  EXPECT_TRUE(bridge_->has_readers(types_[0]));
  EXPECT_TRUE(bridge_->has_readers(types_[1]));
  EXPECT_TRUE(wire_.rejected.empty());
  wire_.restart();
  wire_.send_answer();
  poll();
  EXPECT_EQ(declared().size(), 2U);
  EXPECT_EQ(wire_.count(ToEndpoints::end_topics), 0) << "it has none that could end";
}

TEST_F(NamedPortTest, TopicsEndWithTheirLine) {
  ASSERT_TRUE(publish(0, 1));
  bridge_->remove_line("line");
  EXPECT_EQ(wire_.count(ToEndpoints::end_topics), 1);
  EXPECT_FALSE(publish(0, 2));
  wire_.restart();
  wire_.send_answer();
  poll();
  EXPECT_TRUE(declared().empty());
}

// A sample that was dropped because its topic had no readers must be made again.
TEST_F(NamedPortTest, ReadersThatLeaveAndComeAreNoticedHoweverLate) {
  report(1, true);
  poll();
  EXPECT_EQ(changes_, 1);
  EXPECT_TRUE(bridge_->has_readers(types_[0]));
  report(1, false);
  report(1, true);
  poll();
  changes_ = 0;
  EXPECT_FALSE(bridge_->has_readers(types_[0]));
  EXPECT_EQ(changes_, 1) << "to be asked again";
  EXPECT_TRUE(bridge_->has_readers(types_[0]));
  wire_.restart();
  wire_.send_answer();
  report(1, true);
  poll();
  EXPECT_FALSE(bridge_->has_readers(types_[0]));
  EXPECT_TRUE(bridge_->has_readers(types_[0]));
  report(1, false);
  poll();
  EXPECT_FALSE(bridge_->has_readers(types_[0]));
}

TEST_F(NamedPortTest, WhatIsReportedOfTopicsThatNeverWereIsNotAccepted) {
  report(3, true);
  report(0, true);
  PortMessage message;
  encode(NamedMisfitMessage{1, "ownership"}, message);  // of no topic that applications write
  wire_.send(message);
  poll();
  EXPECT_EQ(wire_.rejected.size(), 3U);
  EXPECT_TRUE(received_.misfits.empty());
}

class NamedSetPortTest : public RemotePortTest {
 protected:
  void SetUp() override {
    RemotePortTest::SetUp();
    ASSERT_TRUE(offer(od::DataType::unsigned8));
    poll();
  }
  // The type of the only group, whose only output has that type.
  bool offer(od::DataType type) {
    const image::Layout layout =
        named::layout_of({{.name = "ram.A", .type = type, .bits = 8, .node = 5}});
    const named::Group group{"g", 3, {0}};
    const auto made = named::group_types("line", layout, std::span(&group, 1));
    return bridge_->set_named_groups("line", made.types);
  }
  // For the gateway g, all in CDR_LE.
  static std::vector<std::byte> sample(std::uint8_t value) {
    std::vector<std::byte> out{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    const auto number = [&](std::uint64_t of, std::size_t size) {
      while ((out.size() - 4) % size != 0)
        out.push_back(std::byte{0});
      for (std::size_t i = 0; i < size; ++i)
        out.push_back(static_cast<std::byte>(of >> 8U * i));
    };
    const auto text = [&](std::string_view of) {
      number(of.size() + 1, 4);
      for (const char c : of)
        out.push_back(static_cast<std::byte>(c));
      out.push_back(std::byte{0});
    };
    text("g");
    text("line");
    number(3, 2);  // group
    number(1, 8);  // incarnation
    text("plc");
    number(1, 8);  // arming
    number(0, 8);  // watchdog
    number(line::kHoldOutputs, 1);
    number(1, 1);  // given
    number(value, 1);
    return out;
  }
  void send(std::uint32_t topic, const std::vector<std::byte>& octets) {
    Participant from{.host = "panel"};
    from.prefix.fill(9);
    PortMessage message;
    encode_named_write(from, {topic, octets}, message);
    wire_.send(message);
  }
};

TEST_F(NamedSetPortTest, AWriteIsAppliedAsItsWriterSentIt) {
  ASSERT_EQ(wire_.count(ToEndpoints::named_set), 1);
  const auto topic = decode_numbered_topic(wire_.to_process.back());
  ASSERT_TRUE(topic);
  EXPECT_EQ(topic->number, 1U);
  EXPECT_EQ(topic->topic.topic, "plant/line/g/outputs/set");
  send(1, sample(0x5A));
  send(1, sample(0xA5));
  poll();
  ASSERT_EQ(received_.outputs.size(), 2U);
  const OutputMessage& output = received_.outputs[0];
  EXPECT_EQ(output.line, "line");
  EXPECT_EQ(output.client, "plc");
  EXPECT_EQ(output.from.host, "panel");
  EXPECT_EQ(output.from.prefix[11], 9);
  EXPECT_TRUE(output.by_name);
  EXPECT_EQ(output.write.group, 3);
  ASSERT_EQ(output.write.values.size(), 1U);
  EXPECT_EQ(output.write.values[0].data[0], std::byte{0x5A});
  EXPECT_TRUE(wire_.rejected.empty());
}

// The same octets may mean something else in the type that the topic has now.
TEST_F(NamedSetPortTest, AWriteForATypeThatIsNoMoreIsDropped) {
  ASSERT_TRUE(offer(od::DataType::integer8));
  EXPECT_EQ(wire_.count(ToEndpoints::end_sets), 1);
  send(1, sample(0x5A));
  poll();
  EXPECT_TRUE(received_.outputs.empty());
  EXPECT_TRUE(wire_.rejected.empty());
  send(2, sample(0x5A));
  poll();
  EXPECT_EQ(received_.outputs.size(), 1U);
}

TEST_F(NamedSetPortTest, AWriteThatNoProcessSendsIsNotAccepted) {
  send(0, sample(1));
  send(2, sample(1));
  std::vector<std::byte> longer = sample(1);
  longer.resize(2'000);
  send(1, longer);
  PortMessage message;
  encode_named_write({}, {1, {}}, message);
  message.pop_back();
  wire_.send(message);
  poll();
  EXPECT_EQ(wire_.rejected.size(), 4U);
  EXPECT_TRUE(received_.outputs.empty());
}

// No change of a message applies what no unchanged sample would: all that can change is what the
// writer may state by itself.
TEST_F(NamedSetPortTest, AnyChangeOfAWriteIsHarmless) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::vector<std::byte> good = sample(0x5A);
  for (int i = 0; i < 5'000; ++i) {
    std::vector<std::byte> octets = good;
    for (auto changes = 1 + random() % 3; changes > 0; --changes)
      octets[random() % octets.size()] = static_cast<std::byte>(random() & 0xFFU);
    octets.resize(random() % 4 == 0 ? random() % (octets.size() + 1) : octets.size());
    send(1, octets);
    poll();
    for (const OutputMessage& output : received_.outputs) {
      EXPECT_EQ(output.line, "line");
      EXPECT_EQ(output.write.group, 3);
      EXPECT_LE(output.write.values.size(), 1U);
      for (const line::OutputValue& value : output.write.values) {
        EXPECT_EQ(value.entry, 0U);
        EXPECT_EQ(value.length, 1);
      }
    }
    received_.outputs.clear();
  }
  EXPECT_TRUE(wire_.rejected.empty()) << "an application may send any octets";
  send(1, good);
  poll();
  EXPECT_EQ(received_.outputs.size(), 1U);
}

TEST_F(NamedSetPortTest, AMisfitNamesItsTopic) {
  PortMessage message;
  encode(NamedMisfitMessage{1, "ownership"}, message);
  wire_.send(message);
  poll();
  EXPECT_EQ(received_.misfits, std::vector<std::string>{"ownership"});
  encode(NamedMisfitMessage{1, "x\n\x1b[2J"}, message);
  wire_.send(message);
  poll();
  EXPECT_EQ(received_.misfits.size(), 1U);
  EXPECT_EQ(wire_.rejected.size(), 1U);
}

}  // namespace
}  // namespace linegate::dds
