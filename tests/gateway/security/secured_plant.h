// SPDX-License-Identifier: Apache-2.0
// A gateway with DDS-Security and the lines press and device, and identities with rights to one of
// them, or both. Participants do not check their own permissions (unchecked_permissions.cpp).
#pragma once

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
#include "tests/paths.h"

namespace linegate::gateway {

class SecuredPlant : public testing::Test {
 protected:
  using Role = security::Role;

  // Fast DDS 2.9.1 does not authenticate every participant that joins late: a new one is made.
  static constexpr int kAttemptsToJoin = 8;
  static constexpr std::chrono::seconds kOneAttemptToJoin{8};
  static constexpr std::uint32_t kStrength = 5;

  // group: of all outputs of press, named all, further keys.
  explicit SecuredPlant(std::string group) : group_(std::move(group)) {}

  void SetUp() override {
    EXPECT_EQ(security::init(authority.string()), "");
    issue("test", Role::gateway);
    issue("olga", Role::operator_, {"test/press"});
    issue("dora", Role::operator_, {"test/device"});
    issue("otto", Role::operator_);
    issue("erin", Role::engineer);
    issue("victor", Role::viewer);
    auto made =
        Gateway::make(named_plant(true, "{groups: [{name: all" + group_ + ", entries: [every.*]}]}",
                                  ", security: " + identity("test")),
                      1);
    ASSERT_TRUE(made.ok());
    gateway_ = std::move(*made.value);
    gateway_->start();
    ASSERT_TRUE(connect());
  }
  ~SecuredPlant() override {
    client_.reset();
    gateway_.reset();
    std::filesystem::remove_all(authority);
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
      options.profile_file = paths::kLoopbackProfiles;
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
  // Calls make() until a writer has matched a reader of the gateway.
  template <class Make>
  auto matched(Make make) -> decltype(make()) {
    for (int attempt = 0; attempt < kAttemptsToJoin; ++attempt) {
      auto made = make();
      if (until([&] { return made->readers() != 0; }, kOneAttemptToJoin))
        return made;
    }
    ADD_FAILURE() << "no writer matches the gateway";
    return nullptr;
  }
  const line::OutputState& state() { return seen_.output_states["press"]; }
  bool has_text(std::string_view part) const {
    return std::ranges::any_of(
        seen_.texts, [&](const std::string& text) { return text.find(part) != std::string::npos; });
  }

  const std::filesystem::path authority =
      std::filesystem::path(testing::TempDir()) / ("secured-plant-" + std::to_string(::getpid()));
  std::unique_ptr<Gateway> gateway_;
  std::unique_ptr<dds::Client> client_;
  GatewayListener seen_;

 private:
  const std::string group_;
};

}  // namespace linegate::gateway
