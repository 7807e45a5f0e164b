// SPDX-License-Identifier: Apache-2.0
// Which participant sent a request: known from its samples, not from the names in them.
#include <array>
#include <map>
#include <memory>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

struct Senders : dds::GatewayHandler {
  void on_output_write(dds::OutputMessage message) override { note(message.from, message.client); }
  void on_command(dds::CommandMessage message) override {
    note(message.from, message.client);
    line::Reply reply;
    reply.tag = message.command.tag;
    bridge->reply(reply);
  }
  void on_gateway_command(dds::GatewayCommandMessage) override {}
  void on_output_refused(const dds::RequestOrigin&, std::uint16_t, line::OutputRefusal,
                         std::string_view) override {}
  void on_command_refused(const dds::RequestOrigin&, std::uint8_t, line::Refusal,
                          std::string_view) override {}
  void note(const dds::Participant& from, const std::string& name) {
    names[from.prefix].insert(name);
    hosts.insert(from.host);
    ++requests;
  }

  dds::GatewayBridge* bridge = nullptr;
  std::map<std::array<std::uint8_t, 12>, std::set<std::string>> names;
  std::set<std::string> hosts;
  int requests = 0;
};

TEST(Senders, AreParticipantsAndTheirHosts) {
  auto made = dds::GatewayBridge::make(
      {known::kGateway, 1, domain(), paths::kLoopbackProfiles, {known::kLine}});
  ASSERT_TRUE(made.ok());
  const auto bridge = std::move(*made.value);
  Senders senders;
  senders.bridge = bridge.get();
  dds::ClientOptions with_outputs = client_options("hmi");
  with_outputs.outputs = true;
  const std::array clients{make_client(with_outputs), make_client(client_options("plc"))};
  dds::ClientListener listener;
  const auto handled = [&](int requests) {
    return eventually([&] {
      for (const auto& client : clients) {
        client->poll(std::chrono::milliseconds(5), listener);
      }
      bridge->poll(std::chrono::milliseconds(5), senders);
      return senders.requests >= requests;
    });
  };
  int requests = 0;
  for (int i = 0; i < 3; ++i) {
    for (const auto& client : clients) {
      const line::Command command{.request = line::LocalRead{}};
      ASSERT_NE(client->send(known_line(), command, kDeadline), 0U);
      ASSERT_TRUE(handled(++requests));
    }
  }
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(clients[0]->write_outputs(known_line(), line::OutputWrite{}));
    clients[0]->poll(std::chrono::milliseconds(5), listener);
    bridge->poll(std::chrono::milliseconds(5), senders);
    return senders.requests > requests;
  }));
  EXPECT_EQ(senders.names.size(), 2U) << "commands and outputs of a participant have one identity";
  for (const auto& [prefix, names] : senders.names) {
    EXPECT_EQ(names.size(), 1U);
    EXPECT_NE(prefix, (std::array<std::uint8_t, 12>{}));
  }
  std::array<char, 256> own{};
  ASSERT_EQ(::gethostname(own.data(), own.size() - 1), 0);
  EXPECT_EQ(senders.hosts, std::set<std::string>{own.data()});
}

}  // namespace
}  // namespace linegate::test
