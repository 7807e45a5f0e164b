// SPDX-License-Identifier: Apache-2.0
// A client that changes to another participant, as when its host gets an address.
#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

using std::chrono::milliseconds;

struct SamplesOnce : dds::ClientListener {
  void on_line(const dds::Source&, const dds::LineInfo&, const line::LineState& state,
               const std::vector<dds::Property>&) override {
    load = state.load_permille;
  }
  void on_image(const dds::Source&, const image::Snapshot& snapshot) override {
    images.push_back(snapshot.sequence);
  }
  void on_event(const dds::Source&, const dds::ReceivedEvent& event, std::string_view,
                const std::vector<dds::Property>&) override {
    events.push_back(event.number);
  }
  void on_layout(const dds::Source&, const image::Layout&) override { ++layouts; }
  void on_line_gone(std::string_view, std::string_view) override { ++lines_gone; }
  void on_reply(const dds::Target&, const dds::CommandResult& result) override {
    replies.push_back(result);
  }

  unsigned load = 0;
  std::vector<std::uint64_t> images;
  std::vector<std::uint64_t> events;
  int layouts = 0;
  int lines_gone = 0;
  std::vector<dds::CommandResult> replies;
};

// Keeps commands until they are answered.
struct WaitingCommands : dds::GatewayHandler {
  void on_command(dds::CommandMessage message) override { commands.push_back(std::move(message)); }
  void on_output_write(dds::OutputMessage message) override {
    outputs.push_back(message.write.arming);
  }
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}
  void on_unreadable(std::uint64_t) override {}
  void on_misfit(std::string_view, std::string_view) override {}

  std::vector<dds::CommandMessage> commands;
  std::vector<std::uint64_t> outputs;
};

class ChangedParticipant : public testing::Test {
 protected:
  void SetUp() override {
    auto made = dds::GatewayBridge::make(
        {known::kGateway, 1, domain(), paths::kLoopbackProfiles, {known::kLine}});
    ASSERT_TRUE(made.ok());
    bridge = std::move(*made.value);
    dds::ClientOptions options = client_options();
    options.follow_interfaces = true;
    options.outputs = true;
    options.retry = milliseconds(20);
    client = make_client(options);
    ASSERT_NE(client, nullptr);
    EXPECT_TRUE(bridge->publish(known::kLine, known::layout()));
    publish();
    ASSERT_TRUE(until([&] { return received.events.size() == 1 && received.layouts == 1; }));
  }

  void publish() {
    ++round;
    line::LineState state = known::line_state();
    state.load_permille = static_cast<std::uint16_t>(round % 1'000);
    image::Snapshot snapshot = known::snapshot();
    snapshot.sequence = round;
    EXPECT_TRUE(bridge->publish(known::line_info(), state, known::at(1)));
    EXPECT_TRUE(bridge->publish(known::kLine, snapshot));
    EXPECT_TRUE(bridge->publish(known::kLine, known::event(round), "text"));
  }
  bool until(const std::function<bool()>& condition) {
    return eventually(
        [&] {
          client->poll(milliseconds(5), received);
          bridge->poll(milliseconds(5), plant);
          return condition();
        },
        kDeadline * 3);
  }
  // each: done again and again meanwhile.
  bool change(const std::function<void()>& each) {
    const std::uint64_t before = client->participants();
    client->change_participant();
    return until([&] {
      each();
      return client->participants() != before;
    });
  }
  static line::Command write() {
    return {.request = line::SdoWrite{.node = 9, .address = {0x2000, 0}, .data = {{}}}};
  }

  std::unique_ptr<dds::GatewayBridge> bridge;
  std::unique_ptr<dds::Client> client;
  SamplesOnce received;
  WaitingCommands plant;
  std::uint64_t round = 0;
};

TEST_F(ChangedParticipant, LosesNothingAndReceivesNothingTwice) {
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(change([&] { publish(); }));
  EXPECT_EQ(client->participants(), 3U);
  publish();
  ASSERT_TRUE(until([&] { return received.events.size() >= round && received.load == round; }));
  ASSERT_EQ(received.events.size(), round);
  for (std::size_t i = 0; i < received.events.size(); ++i)
    ASSERT_EQ(received.events[i], i + 1) << "an event is missing or was received twice";
  EXPECT_TRUE(std::ranges::is_sorted(received.images) &&
              std::ranges::adjacent_find(received.images) == received.images.end());
  EXPECT_EQ(received.images.back(), round);
  EXPECT_EQ(received.layouts, 1);
  EXPECT_EQ(received.lines_gone, 0);
}

TEST_F(ChangedParticipant, ACommandUnderWayIsCarriedOutOnce) {
  const auto id = client->send(known_line(), write(), kDeadline);
  ASSERT_TRUE(until([&] { return plant.commands.size() == 1; }));
  ASSERT_TRUE(change([] {}));
  const auto other = client->send(known_line(), write(), kDeadline);
  ASSERT_TRUE(until([&] { return plant.commands.size() == 2; }));
  EXPECT_NE(plant.commands[0].from.prefix, plant.commands[1].from.prefix);
  for (const dds::CommandMessage& one : plant.commands)
    bridge->reply({.tag = one.command.tag});
  ASSERT_TRUE(until([&] { return received.replies.size() == 2; }));
  EXPECT_EQ((std::set{received.replies[0].id, received.replies[1].id}), (std::set{id, other}));
  EXPECT_TRUE(received.replies[0].reply.ok() && received.replies[1].reply.ok());
  EXPECT_EQ(plant.commands.size(), 2U) << "each was repeated while it was not answered";
}

TEST_F(ChangedParticipant, OutputsAreWrittenOn) {
  line::OutputWrite write;
  write.group = 2;
  write.watchdog = milliseconds(250);
  const auto arming_arrives = [&](std::uint64_t arming) {
    write.arming = arming;
    return until([&] {
      client->write_outputs(known_line(), write);
      return !plant.outputs.empty() && plant.outputs.back() == arming;
    });
  };
  ASSERT_TRUE(arming_arrives(1));
  ASSERT_TRUE(change([&] { client->write_outputs(known_line(), write); }));
  EXPECT_TRUE(arming_arrives(2));
}

TEST_F(ChangedParticipant, AGatewayThatEndsMeanwhileIsGone) {
  ASSERT_TRUE(change([&] { publish(); }));
  client->change_participant();
  bridge.reset();
  EXPECT_TRUE(eventually(
      [&] {
        client->poll(milliseconds(20), received);
        return client->participants() == 3 && received.lines_gone == 1;
      },
      kDeadline * 3));
}

}  // namespace
}  // namespace linegate::test
