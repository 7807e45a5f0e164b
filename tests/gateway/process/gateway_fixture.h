// SPDX-License-Identifier: Apache-2.0
// The whole gateway in one process: simulated devices on one side, a DDS client on the other.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "bridges/dds/client.h"
#include "bridges/dds/publisher.h"
#include "gateway/process/gateway.h"
#include "gateway/runtime/clock.h"

#include "tests/dds/own_domain.h"
#include "tests/gateway/plans.h"
#include "tests/gateway/process/gateway_listener.h"
#include "tests/paths.h"

namespace linegate::gateway {

inline constexpr Duration kPatience = std::chrono::seconds(20);

// `dds` has further keys of `dds:`, each behind a comma.
inline std::string plant_text(const std::string& dds = {}) {
  return "schema: 1\ngateway: {name: test}\ndds: {domain: " + std::to_string(test::own_domain()) +
         ", process: " + place_of_dds().process + ", profile: " + paths::kLoopbackProfiles + dds +
         R"(}
lines:
  - name: open
    interface: "simulated:"
    access: all
    sdo_timeout: 500ms
    pdo_update: {every: true, queue: 1024}
    nodes:
      - {id: 5, name: io, eds: bridges/sim/eds/digital-io.eds, heartbeat: 100ms, pdos: {tpdo1: {rtr: true}}}
    simulate: [{node: 5, profile: digital-io}]
    own_objects: {"2100:1": {type: u32, map: true}}
    own_pdos: {tpdo100: {cob_id: 0x1F0, mpdo: destination, map: ["2100:1"]}}
    outputs:
      groups: [{name: lamps, number: 3, entries: [io.*]}]
  - name: closed
    interface: "simulated:"
    access: read
    nodes:
      - {id: 6, name: drive, eds: bridges/sim/eds/drive.eds, heartbeat: 100ms}
    simulate: [{node: 6, profile: drive}]
)";
}

class GatewayTest : public testing::Test {
 protected:
  static constexpr std::uint64_t kIncarnation = 0x1234'5678'9ABC'DEF0;

  void SetUp() override {
    auto made = Gateway::make(make_plant(text()), kIncarnation);
    for (const auto& diagnostic : made.diagnostics) {
      EXPECT_EQ(diagnostic.severity, Severity::note) << to_string(diagnostic);
    }
    ASSERT_TRUE(made.ok());
    gateway_ = std::move(*made.value);
    gateway_->start();
    dds::ClientOptions options;
    options.domain = test::own_domain();
    options.profile_file = paths::kLoopbackProfiles;
    options.outputs = true;
    auto client = dds::Client::make(options);
    ASSERT_TRUE(client.ok());
    client_ = std::move(*client.value);
    ASSERT_TRUE(until([&] {
      return operational("open/io") && operational("closed/drive") &&
             client_->command_peers() > 0 && client_->output_peers() > 0 &&
             seen_.layouts.size() == 4 && seen_.lines.size() == 2;
    }));
  }

  virtual std::string text() const { return plant_text(); }

  bool operational(const std::string& node) {
    return seen_.nodes[node].state == nmt::State::operational;
  }
  bool until(const std::function<bool()>& condition) {
    const Instant give_up = monotonic_now() + kPatience;
    while (!condition()) {
      if (monotonic_now() > give_up) {
        return false;
      }
      client_->poll(std::chrono::milliseconds(50), seen_);
    }
    return true;
  }
  static dds::Target at(const std::string& line, std::uint64_t incarnation = 0) {
    return {"test", line, incarnation};
  }
  static line::Command sdo_read(std::uint8_t node, std::uint16_t index, std::uint8_t sub) {
    line::Command command{.request = line::SdoRead{.node = node, .address = {index, sub}}};
    return command;
  }
  dds::CommandResult call(const dds::Target& target, const line::Command& command,
                          std::uint64_t layout_id = 0) {
    return client_->call(target, command, std::chrono::seconds(10), seen_, layout_id);
  }
  dds::CommandResult call_gateway(const dds::Target& target,
                                  const request::GatewayRequest& request) {
    return client_->call_gateway(target, request, std::chrono::seconds(10), seen_);
  }

  std::unique_ptr<Gateway> gateway_;
  std::unique_ptr<dds::Client> client_;
  GatewayListener seen_;
};

}  // namespace linegate::gateway
