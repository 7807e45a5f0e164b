// SPDX-License-Identifier: Apache-2.0
// Clients are distinguished by their participants, wherever the DDS endpoints of the gateway are.
#include <algorithm>
#include <array>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/gateway/process/gateway_fixture.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

class ClientIdentityTest : public GatewayTest {
 protected:
  static constexpr int kFlood = 400;

  // At 1 % of the bus, some frames a second: a flood is beyond the share at once.
  std::string text() const override {
    std::string out = plant_text();
    const std::string access = "    access: all\n";
    out.insert(out.find(access) + access.size(), "    request_share: 1%\n    client_share: 1%\n");
    return out;
  }
  static std::unique_ptr<dds::Client> make_client(const std::string& name) {
    dds::ClientOptions options;
    options.name = name;
    options.domain = test::own_domain();
    options.profile_file = paths::kLoopbackProfiles;
    options.outputs = true;
    auto made = dds::Client::make(options);
    return made.ok() ? std::move(*made.value) : nullptr;
  }
  bool has_text(const std::string& part) const {
    return std::ranges::any_of(
        seen_.texts, [&](const std::string& text) { return text.find(part) != std::string::npos; });
  }
  static std::string host() {
    std::array<char, 256> name{};
    EXPECT_EQ(::gethostname(name.data(), name.size() - 1), 0);
    return name.data();
  }
  static line::Command start_node() { return {.request = line::NmtRequest{.node = 5}}; }
};

TEST_F(ClientIdentityTest, EventsNameTheClientAndItsHost) {
  const std::array clients{make_client("panel"), make_client("recorder")};
  for (const auto& client : clients) {
    ASSERT_NE(client, nullptr);
    ASSERT_TRUE(client->call(at("open"), start_node(), std::chrono::seconds(10), seen_).reply.ok());
  }
  EXPECT_TRUE(until(
      [&] { return has_text(" of panel at " + host()) && has_text(" of recorder at " + host()); }));
}

TEST_F(ClientIdentityTest, AFloodOfOneClientDoesNotHoldBackAnother) {
  const auto flood = make_client("flood");
  ASSERT_NE(flood, nullptr);
  ASSERT_TRUE(flood->call(at("open"), start_node(), std::chrono::seconds(10), seen_).reply.ok());
  GatewayListener of_flood;
  for (int i = 0; i < kFlood; ++i) {
    flood->send(at("open"), start_node(), std::chrono::seconds(10));
    flood->poll(Duration::zero(), of_flood);
  }
  EXPECT_TRUE(call(at("open"), sdo_read(5, 0x1000, 0)).reply.ok());
  EXPECT_TRUE(until([&] {
    flood->poll(Duration::zero(), of_flood);
    return seen_.happened("open", EventKind::client_limited);
  }));
  EXPECT_TRUE(has_text("flood at " + host()));
}

}  // namespace
}  // namespace linegate::gateway
