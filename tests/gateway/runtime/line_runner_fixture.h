// SPDX-License-Identifier: Apache-2.0
// A line on a simulated channel, in virtual time.
#pragma once

#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/runtime/line_runner.h"

#include "tests/gateway/plans.h"
#include "tests/gateway/runtime/fake_channel.h"

namespace linegate::gateway {

using namespace std::chrono_literals;

inline constexpr const char* kOneNode = R"(schema: 1
lines:
  - name: a
    interface: virtual:a
    reset_nodes: true
    sdo_timeout: 50ms
    access: all
    publish: {on_change: {min_separation: 10ms}}
    nodes:
      - {id: 5, name: io, eds: bridges/sim/eds/digital-io.eds, check_identity: false}
)";

class LineRunnerTest : public testing::Test {
 protected:
  explicit LineRunnerTest(const char* text = kOneNode) : plant_(make_plant(text)) {
    auto channel = std::make_unique<FakeChannel>();
    channel_ = channel.get();
    runner_ = std::make_unique<LineRunner>(make_line(plan()), std::move(channel), plan(), port_,
                                           consumer_);
  }

  const config::LinePlan& plan() const { return plant_.lines.at(0); }

  void serve(Duration later = 0ns) {
    now_ += later;
    runner_->called();
    runner_->service(now_);
  }
  void make_ready() {
    can::BusEvent event;
    event.kind = can::BusEvent::Kind::interface_ready;
    event.time = now_;
    channel_->coming_events.push_back(event);
    serve();
  }
  void come(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can::Frame frame = can::make_frame(id, data);
    frame.time = now_;
    channel_->coming.push_back(frame);
  }
  std::vector<Event> events() {
    std::vector<Event> out;
    for (Event event; port_.events.pop(event);) {
      out.push_back(event);
    }
    return out;
  }
  bool happened(EventKind kind) {
    bool found = false;
    for (const Event& event : events()) {
      found = found || event.kind() == kind;
    }
    return found;
  }
  // Answers every SDO upload with 4 zero bytes and every download with success, until the node is
  // started. It has no PDO records.
  void boot() {
    make_ready();
    come(0x705, {0x00});
    for (int i = 0; i < 200; ++i) {
      serve(1ms);
      for (const can::Frame& frame : std::exchange(channel_->sent, {})) {
        const auto byte = [&](std::size_t k) {
          return std::to_integer<std::uint8_t>(frame.data[k]);
        };
        const bool is_pdo_record = byte(2) >= 0x14 && byte(2) <= 0x1B;
        if (frame.id == 0x605 && byte(0) == 0x40 && is_pdo_record) {
          come(0x585, {0x80, byte(1), byte(2), byte(3), 0x00, 0x00, 0x02, 0x06});
        } else if (frame.id == 0x605) {
          const auto answer = static_cast<std::uint8_t>(byte(0) == 0x40 ? 0x43 : 0x60);
          come(0x585, {answer, byte(1), byte(2), byte(3), 0, 0, 0, 0});
        }
      }
    }
  }
  static constexpr line::SdoRead kRead{.node = 5, .address = {0x1000, 0}};
  void send_command(std::uint64_t tag, line::Request request) {
    line::Command command{.tag = tag, .request = std::move(request)};
    port_.commands.push(command);
  }
  void send_command(std::uint64_t tag, request::GatewayRequest request) {
    request::GatewayCommand command{.tag = tag, .request = std::move(request)};
    port_.interface_commands.push(command);
  }

  config::Plant plant_;
  LinePort port_{room_for_receptions(plan().config)};
  exchange::Wakeup consumer_;
  FakeChannel* channel_ = nullptr;
  std::unique_ptr<LineRunner> runner_;
  Instant now_{1s};
};

}  // namespace linegate::gateway
