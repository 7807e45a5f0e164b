// SPDX-License-Identifier: Apache-2.0
// An SDO that crosses two lines with real threads: lines of one executor, and of two.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>

#include "bridges/sim/virtual_channel.h"
#include "gateway/runtime/channels.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/device_runner.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_runner.h"
#include "gateway/runtime/route_links.h"
#include "stack/base/abort_code.h"

#include "tests/gateway/plans.h"

namespace linegate::gateway {
namespace {

constexpr int kCrossingPatience = 20'000;  // ms; a test that waits so long has failed

class CrossingTest : public testing::TestWithParam<bool> {
 protected:
  struct Side {
    LinePort port;
    LineRunner* runner = nullptr;
    Executor* executor = nullptr;
  };

  CrossingTest()
      : plant_(make_plant(R"(schema: 1
lines:
  - {name: press, interface: "virtual:press", network_id: 1, reset_nodes: false}
  - name: pack
    interface: "simulated:"
    network_id: 2
    reset_nodes: false
    access: all
    enter: press
    simulate: [{node: 20, profile: digital-io}]
)")) {
    const bool one_executor = GetParam();
    for (std::size_t i = 0; i < 2; ++i) {
      const config::LinePlan& plan = plant_.lines.at(i);
      Side& side = sides_[i];
      side.executor = &executors_[one_executor ? 0 : i];
      auto runner = std::make_unique<LineRunner>(
          make_line(plan), open_channel(plan.interface, 0, network_), plan, side.port, consumer_);
      runner->route(std::make_unique<RouteEnd>());
      side.runner = runner.get();
      side.executor->add(std::move(runner));
    }
    for (const auto& [link, from, to] : {std::tuple{&there_, 0, 1}, std::tuple{&back_, 1, 0}}) {
      link->taker =
          one_executor ? nullptr : &sides_[static_cast<std::size_t>(to)].executor->wakeup();
      sides_[static_cast<std::size_t>(from)].runner->routes()->add_out(*link);
      sides_[static_cast<std::size_t>(to)].runner->routes()->add_in(*link);
    }
    for (Executor& executor : executors_) {
      executor.start();
    }
    EXPECT_TRUE(heard(1, EventKind::line_started));
    auto devices = make_devices(plant_.lines[1].simulated);
    EXPECT_TRUE(devices.ok());
    devices_.add(std::make_unique<DeviceRunner>(
        std::move(*devices.value), open_channel(plant_.lines[1].interface, 0, network_), "pack",
        false));
    devices_.start();
    EXPECT_TRUE(heard(1, EventKind::boot_up));
  }

  template <class Look>
  bool wait(Look&& look) {
    for (;;) {
      consumer_.clear();
      if (look()) {
        return true;
      }
      pollfd p{consumer_.descriptor(), POLLIN, 0};
      if (poll(&p, 1, kCrossingPatience) != 1) {
        return false;
      }
    }
  }
  bool heard(std::size_t i, EventKind kind) {
    return wait([&] {
      for (Event event; sides_[i].port.events.pop(event);) {
        if (event.kind() == kind) {
          return true;
        }
      }
      return false;
    });
  }
  line::Command read_in_network(od::Address address, std::uint16_t network = 2) {
    return {.tag = ++tag_,
            .request = line::NetworkRead{.network = network, .node = 20, .address = address}};
  }
  // Sends the command to the line "press" and waits for its reply.
  line::Reply ask(line::Command command) {
    const std::uint64_t tag = command.tag;
    EXPECT_TRUE(sides_[0].port.commands.push(command));
    sides_[0].executor->wakeup().signal();
    line::Reply reply;
    EXPECT_TRUE(wait([&] { return sides_[0].port.replies.pop(reply); }));
    EXPECT_EQ(reply.tag, tag);
    return reply;
  }
  routing::Counters counters(std::size_t i) {
    routing::Counters out;
    sides_[i].executor->visit([&] { out = sides_[i].runner->line().state().routing; });
    return out;
  }

  config::Plant plant_;
  sim::VirtualNetwork network_;
  exchange::Wakeup consumer_;
  RouteLink there_{1, 2};
  RouteLink back_{2, 1};
  std::array<Side, 2> sides_;
  std::uint64_t tag_ = 0;
  std::array<Executor, 2> executors_{Executor({}), Executor({})};
  Executor devices_{{}};
};

TEST_P(CrossingTest, ReadsAndWritesADeviceOfAnotherLine) {
  for (int i = 0; i < 20; ++i) {
    const line::Reply vendor = ask(read_in_network({0x1018, 1}));
    ASSERT_TRUE(vendor.ok()) << vendor.error.code;
    EXPECT_EQ(vendor.bytes(), (std::vector<std::byte>{std::byte{0x47}, std::byte{0x4C}, {}, {}}));
  }
  const line::Reply name = ask(read_in_network({0x1008, 0}));
  EXPECT_GT(name.bytes().size(), 7U) << "in segments, or a block";
  EXPECT_EQ(ask(read_in_network({0x2FFF, 0})).error, to_error(AbortCode::no_object));
  const line::NetworkWrite write{
      .network = 2, .node = 20, .address = {0x1017, 0}, .data = {std::byte{0xE8}, std::byte{3}}};
  EXPECT_TRUE(ask({.tag = ++tag_, .request = write}).ok());
  EXPECT_EQ(ask(read_in_network({0x1017, 0})).bytes(), write.data);
  EXPECT_EQ(ask(read_in_network({0x1018, 1}, 9)).error, to_error(AbortCode::invalid_value));
  EXPECT_TRUE(heard(0, EventKind::routing_refused));
  const routing::Counters counted = counters(0);
  EXPECT_EQ(counted.open, 0U);
  EXPECT_EQ(counted.opened, counted.finished + counted.aborted + counted.timed_out);
  EXPECT_EQ(counters(1).channels, 0U);
}

TEST_P(CrossingTest, ALineThatIsTakenAwayLeavesNobodyWaiting) {
  EXPECT_TRUE(ask(read_in_network({0x1018, 1})).ok());
  // Its interface falls silent: a transfer is under way when the line goes.
  devices_.request_stop();
  devices_.join();
  line::Command read = read_in_network({0x1018, 1});
  EXPECT_TRUE(sides_[0].port.commands.push(read));
  sides_[0].executor->wakeup().signal();
  EXPECT_EQ(sides_[1].executor->send_away({sides_[1].runner}).size(), 1U);
  sides_[0].executor->visit([&] { sides_[0].runner->leave(2, monotonic_now()); });
  line::Reply reply;
  EXPECT_TRUE(wait([&] { return sides_[0].port.replies.pop(reply); }));
  EXPECT_FALSE(reply.ok());
  EXPECT_FALSE(ask(read_in_network({0x1018, 1})).ok());
  EXPECT_EQ(counters(0).open, 0U);
}

INSTANTIATE_TEST_SUITE_P(Executors, CrossingTest, testing::Bool(),
                         [](const auto& one) { return one.param ? "One" : "Two"; });

}  // namespace
}  // namespace linegate::gateway
