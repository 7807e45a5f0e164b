// SPDX-License-Identifier: Apache-2.0
// Named topics of a gateway with DDS-Security: what each identity reads, and whose samples have an
// effect. Participants do not check their own permissions (unchecked_permissions.cpp).
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/security/authority.h"

#include "tests/gateway/process/named_fixture.h"

namespace linegate::gateway {
namespace {

namespace folders = std::filesystem;
using security::Role;

// Fast DDS 2.9.1 does not authenticate every participant that joins late: a new one is made.
constexpr int kAttemptsToJoin = 8;
constexpr std::chrono::seconds kOneAttemptToJoin{8};
constexpr int kSamplesOfStrangers = 100;
constexpr std::uint32_t kStrength = 5;

class NamedRights : public testing::Test {
 protected:
  void SetUp() override {
    EXPECT_EQ(security::init(authority.string()), "");
    issue("test", Role::gateway);
    issue("olga", Role::operator_, {"test/press"});
    issue("dora", Role::operator_, {"test/device"});
    issue("otto", Role::operator_);
    issue("erin", Role::engineer);
    issue("victor", Role::viewer);
    auto made = Gateway::make(
        named_plant(true, "{groups: [{name: all, written_by: named, entries: [every.*]}]}",
                    ", security: " + identity("test")),
        1);
    ASSERT_TRUE(made.ok());
    gateway_ = std::move(*made.value);
    gateway_->start();
    ASSERT_TRUE(connect());
  }
  ~NamedRights() override {
    client_.reset();
    gateway_.reset();
    folders::remove_all(authority);
  }

  void issue(const std::string& name, Role role, std::vector<std::string> lines = {"*/*"}) const {
    EXPECT_EQ(security::issue(authority.string(), {{name, role, std::move(lines)}, 60}), "");
  }
  std::string identity(const std::string& name) const { return (authority / name).string(); }

  // A viewer that observes the effect of each sample.
  bool connect() {
    for (int attempt = 0; attempt < kAttemptsToJoin; ++attempt) {
      client_.reset();
      seen_ = {};
      dds::ClientOptions options;
      options.domain = test::own_domain();
      options.profile_file = LOOPBACK_PROFILES;
      options.commands = false;
      options.security = dds::security_with(security::files_in(identity("victor")));
      auto made = dds::Client::make(options);
      if (!made.ok())
        return false;
      client_ = std::move(*made.value);
      if (until([&] { return seen_.nodes["press/every"].state == nmt::State::operational; },
                kOneAttemptToJoin))
        return true;
    }
    return false;
  }
  bool until(const std::function<bool()>& done, std::chrono::seconds limit = kNamedPatience) {
    const Instant end = monotonic_now() + limit;
    while (!done()) {
      if (monotonic_now() > end)
        return false;
      client_->poll(std::chrono::milliseconds(20), seen_);
    }
    return true;
  }
  // Makes writers until one has matched the reader of the gateway.
  std::unique_ptr<SetWriter> writer(const std::string& name, const std::string& partition,
                                    std::uint32_t strength = kStrength) {
    for (int attempt = 0; attempt < kAttemptsToJoin; ++attempt) {
      auto made = std::make_unique<SetWriter>(name, strength, partition, identity(name));
      if (until([&] { return made->readers() != 0; }, kOneAttemptToJoin))
        return made;
    }
    ADD_FAILURE() << name << " does not match the gateway in " << partition;
    return nullptr;
  }
  std::unique_ptr<NamedReader<OutputsType>> reader(const std::string& name) {
    for (int attempt = 0; attempt < kAttemptsToJoin; ++attempt) {
      auto made = std::make_unique<NamedReader<OutputsType>>(
          "plant/press/every/outputs", fast::TRANSIENT_LOCAL_DURABILITY_QOS, identity(name));
      const auto arrived = [&] {
        made->take();
        return made->first != 0;
      };
      if (until(arrived, kOneAttemptToJoin))
        return made;
    }
    ADD_FAILURE() << name << " receives nothing";
    return nullptr;
  }
  const line::OutputState& state() { return seen_.output_states["press"]; }
  bool has_text(std::string_view part) const {
    return std::ranges::any_of(
        seen_.texts, [&](const std::string& text) { return text.find(part) != std::string::npos; });
  }

  const folders::path authority =
      folders::path(testing::TempDir()) / ("named-rights-" + std::to_string(::getpid()));
  std::unique_ptr<Gateway> gateway_;
  std::unique_ptr<dds::Client> client_;
  GatewayListener seen_;
};

TEST_F(NamedRights, AValueOfAnOperatorOrEngineerIsAppliedAndReadByAViewer) {
  const auto outputs = reader("victor");
  ASSERT_NE(outputs, nullptr);
  int value = 200;
  for (const auto& [name, right] : {std::pair("olga", "operator"), std::pair("erin", "engineer")}) {
    const auto plc = writer(name, "test/press/" + std::string(right) + "/" + name);
    ASSERT_NE(plc, nullptr);
    ++value;
    plc->sample.values().every_Set_24V_supply(static_cast<std::uint8_t>(value));
    plc->sample.given().every_Set_24V_supply(true);
    EXPECT_TRUE(until([&] {
      plc->write();
      outputs->take();
      return outputs->sample.values().Set_24V_supply() == value && state().owner == name;
    })) << name
        << ": " << state().owner;
  }
  EXPECT_EQ(state().refused, 0U);
}

// A viewer, an operator of another line, and one who claims to be another. Their samples would win,
// and their own libraries would send them, but the gateway does not match their writers.
TEST_F(NamedRights, WhoHasNoRightToTheLineHasNoEffect) {
  std::vector<std::unique_ptr<SetWriter>> strangers;
  for (const auto& [name, partition] : {std::pair("victor", "test/press/viewer/victor"),
                                        std::pair("victor", "test/press/operator/olga"),
                                        std::pair("dora", "test/device/operator/dora"),
                                        std::pair("dora", "test/press/operator/dora"),
                                        std::pair("dora", "test/press/operator/olga")}) {
    strangers.push_back(
        std::make_unique<SetWriter>(name, kStrength + 1, partition, identity(name)));
    strangers.back()->sample.values().every_Set_24V_supply(111);
    strangers.back()->sample.given().every_Set_24V_supply(true);
  }
  const auto plc = writer("olga", "test/press/operator/olga");
  const auto outputs = reader("victor");
  ASSERT_TRUE(plc != nullptr && outputs != nullptr);
  plc->sample.values().every_Set_24V_supply(240);
  plc->sample.given().every_Set_24V_supply(true);
  bool had_effect = false;
  int rounds = 0;
  EXPECT_TRUE(until([&] {
    for (const auto& stranger : strangers)
      stranger->write();
    plc->write();
    outputs->take();
    had_effect = had_effect || outputs->sample.values().Set_24V_supply() == 111;
    return ++rounds > kSamplesOfStrangers && state().owner == "olga" && state().applied > 10;
  }));
  EXPECT_FALSE(had_effect);
  for (const auto& stranger : strangers)
    EXPECT_EQ(stranger->readers(), 0);
  EXPECT_EQ(outputs->sample.values().Set_24V_supply(), 240);
  EXPECT_EQ(state().refused, 0U) << "samples that no permissions allow are not received";
}

// The permissions of this operator allow both lines, each in its own partition.
TEST_F(NamedRights, ASampleInThePartitionOfAnotherLineIsRefused) {
  const auto otto = writer("otto", "test/device/operator/otto");
  ASSERT_NE(otto, nullptr);
  otto->sample.given().every_Set_24V_supply(true);
  EXPECT_TRUE(until([&] {
    otto->write();
    return has_text("its writer has no right to send requests to this line") ||
           state().refusal == line::OutputRefusal::no_right;
  }));
  EXPECT_EQ(state().applied, 0U);
  EXPECT_EQ(state().owner, "");
}

}  // namespace
}  // namespace linegate::gateway
