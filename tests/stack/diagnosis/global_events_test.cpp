// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/global_events.h"

#include <gtest/gtest.h>

#include "stack/can/bus_state.h"
#include "stack/manager/state.h"

namespace linegate::diagnosis {
namespace {

using can::BusState;

constexpr std::uint8_t kSelf = 127;
constexpr line::Refusal kBusy{1};  // enumerators of line::Refusal
constexpr line::Refusal kNotPermitted{2};

struct Row {
  const char* what;
  Event event;
  EventContext context;
  std::uint16_t bits;
};

Event of_line(const EventData& data) {
  return {.data = data};
}
Event of_node(const EventData& data) {
  return {.node = 5, .data = data};
}
Event boot_result(char letter) {
  return of_node(event::BootResult{.letter = letter});
}

// A boot result whose reason is an SDO time-out.
Event silent(char letter) {
  return of_node(event::BootResult{
      .letter = letter, .cause = event::BootCause::abort, .abort = AbortCode::timeout});
}

Event bus(BusState now, BusState before) {
  return of_line(event::BusState{.state = now, .before = before});
}

constexpr EventContext kOptional{.own_node = kSelf};
constexpr EventContext kMandatory{.own_node = kSelf, .mandatory = true};
constexpr EventContext kScanning{.own_node = kSelf, .scanning = true};

TEST(GlobalEvents, EachHasItsBit) {
  const Row rows[] = {
      {"bus-off", bus(BusState::bus_off, BusState::error_passive), kOptional, 1U << 0U},
      {"error passive", bus(BusState::error_passive, BusState::error_active), kOptional, 0},
      {"frames lost", of_line(event::FramesLost{}), kOptional, 1U << 0U},
      {"own ID taken", {.node = kSelf, .data = event::DuplicateNodeId{}}, kOptional, 1U << 1U},
      {"mandatory lost", of_node(event::HeartbeatLost{}), kMandatory, 1U << 2U},
      {"optional lost", of_node(event::HeartbeatLost{}), kOptional, 0},
      {"life guarding", of_node(event::HeartbeatLost{.by = event::ErrorControl::life_guarding}),
       kMandatory, 0},
      {"wrong device type", boot_result('C'), kMandatory, 1U << 3U},
      {"wrong serial", boot_result('O'), kOptional, 1U << 4U},
      {"booted", boot_result(manager::kBooted), kMandatory, 0},
      {"no answer", boot_result('B'), kMandatory, 0},
      {"fell silent", silent('N'), kMandatory, 0},
      {"configuration", boot_result('J'), kMandatory, 1U << 3U | 1U << 10U},
      {"configuration", boot_result('J'), kOptional, 1U << 10U},
      {"an entry refused", of_node(event::ConfigurationError{}), kOptional, 1U << 10U},
      {"an own PDO", {.node = kSelf, .data = event::ConfigurationError{}}, kOptional, 1U << 5U},
      {"lost in a scan", of_node(event::HeartbeatLost{}), kScanning, 1U << 6U},
      {"came in a scan", of_node(event::BootUp{}), kScanning, 1U << 6U},
      {"boot-up", of_node(event::BootUp{}), kOptional, 0},
      {"short PDO", of_node(event::PdoLength{.number = 1, .mapped = 8, .received = 7}), kOptional,
       1U << 9U},
      {"long PDO", of_node(event::PdoLength{.number = 1, .mapped = 4, .received = 8}), kOptional,
       0},
      {"queue full", of_line(event::CommandRefused{.refusal = kBusy}), kOptional, 1U << 11U},
      {"not permitted", of_line(event::CommandRefused{.refusal = kNotPermitted}), kOptional, 0},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(global_events(row.event, row.context), row.bits) << row.what;
  }
}

TEST(CommunicationState, BitsAreThoseOfTheManual) {
  CommunicationState state;
  EXPECT_EQ(state.value(), 0x00);
  state.note(bus(BusState::error_passive, BusState::error_active));
  EXPECT_EQ(state.value(), 0x08);
  state.note(bus(BusState::bus_off, BusState::error_passive));
  EXPECT_EQ(state.value(), 0x04) << "the error state became worse";
  state.note(bus(BusState::error_warning, BusState::bus_off));
  state.note(bus(BusState::error_active, BusState::error_warning));
  EXPECT_EQ(state.value(), 0x10);
  state.note(of_line(event::FramesLost{}));
  state.note(of_line(event::QueueFull{}));
  EXPECT_EQ(state.value(), 0x52);
  state.begin();
  EXPECT_EQ(state.value(), 0x00);
}

}  // namespace
}  // namespace linegate::diagnosis
