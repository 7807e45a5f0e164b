// SPDX-License-Identifier: Apache-2.0
// A line that sleeps and wakes; the test simulates the bus.
#pragma once

#include <string>
#include <vector>

#include "stack/od/dictionary.h"

#include "tests/stack/line/observer_fixture.h"

namespace linegate::line {

using nmt::SleepPhase;

inline LineConfig sleepy(Role role = Role::manager) {
  LineConfig config = config_with_axis();
  config.role = role;
  config.heartbeat = milliseconds(200);
  config.nodes[0].heartbeat_consumer = seconds(5);
  config.sync_period = role == Role::manager ? milliseconds(50) : Duration{};
  config.sleep = {.request = 0x690, .objection = 0x691};
  config.defaults = {{.entry = 0, .value = 9}, {.entry = 1, .value = 3}};
  return config;
}

class SleepTest : public ObserverTest {
 protected:
  void ask(SleepAction action) {
    line_->execute({.tag = 7, .request = SleepRequest{action}}, now_);
    hand_out_all();
  }
  // The reply: "refused", or the nodes that object; "-" if there is none yet.
  std::string reply() {
    Reply reply;
    if (!line_->pop_reply(reply)) {
      return "-";
    }
    EXPECT_EQ(reply.tag, 7U);
    std::string out = reply.ok() ? "" : "refused";
    for (const std::byte node : reply.bytes()) {
      out += std::to_string(std::to_integer<int>(node)) + " ";
    }
    return out;
  }
  SleepPhase phase() const { return line_->state().sleep.value_or(SleepPhase::awake); }
  std::string phases() {
    std::string out;
    for (const Event& event : of(EventKind::sleep_state)) {
      const auto& state = std::get<event::SleepState>(event.data);
      out += std::string(nmt::name(state.phase)) + " ";
    }
    return out;
  }
  // Passes that time and expects that nothing is sent, that no node is reported as lost, and that
  // no state is shown for the time in which none is received.
  void expect_silence_for(Duration time) {
    for (Duration passed{}; passed < time; passed += milliseconds(100)) {
      pass(milliseconds(100));
      expect_silence();
      for (const Event& event : events()) {
        EXPECT_NE(event.kind(), EventKind::heartbeat_lost);
        EXPECT_NE(event.kind(), EventKind::boot_result);
        EXPECT_NE(event.kind(), EventKind::emcy_sent);
      }
      EXPECT_EQ(line_->node_state(5).presence, manager::Presence::present);
      if (phase() >= SleepPhase::silent) {
        EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
        EXPECT_EQ(line_->state().nodes_operational, 0);
      }
    }
  }
  void run(LineConfig config) {
    make(std::move(config));
    boot();
    pass(milliseconds(1));
    hear(0x185, {1, 2, 3, 4, 5, 6});
    sent();
    events();
  }
  void fall_asleep() {
    ask(SleepAction::prepare);
    EXPECT_EQ(reply(), "");
    pass(seconds(2));
    ASSERT_EQ(phase(), SleepPhase::asleep);
    sent();
    events();
  }
};

}  // namespace linegate::line
