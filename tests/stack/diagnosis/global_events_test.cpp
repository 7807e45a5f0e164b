// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/global_events.h"

#include <gtest/gtest.h>

#include "stack/can/bus_state.h"

namespace linegate::diagnosis {
namespace {

using can::BusState;

constexpr std::uint8_t kSelf = 127;

struct Row {
  const char* what;
  Event event;
  EventContext context;
  std::uint16_t bits;
};

Event event(EventKind kind, std::uint8_t node, std::uint32_t code = 0, std::uint32_t value = 0,
            std::uint8_t first_byte = 0) {
  Event out{.kind = kind, .node = node, .code = code, .value = value};
  out.data[0] = std::byte{first_byte};
  return out;
}

// A boot result whose reason is an SDO time-out.
Event silent(Event out) {
  out.value = 0x0504'0000;
  out.length = 8;
  out.data[3] = std::byte{1};
  return out;
}

Event bus(BusState now, BusState before) {
  return event(EventKind::bus_state, 0, static_cast<std::uint32_t>(now),
               static_cast<std::uint32_t>(before));
}

constexpr EventContext kOptional{.own_node = kSelf};
constexpr EventContext kMandatory{.own_node = kSelf, .mandatory = true};
constexpr EventContext kScanning{.own_node = kSelf, .scanning = true};

TEST(GlobalEvents, EachHasItsBit) {
  const Row rows[] = {
      {"bus-off", bus(BusState::bus_off, BusState::error_passive), kOptional, 1U << 0U},
      {"error passive", bus(BusState::error_passive, BusState::error_active), kOptional, 0},
      {"frames lost", event(EventKind::frames_lost, 0), kOptional, 1U << 0U},
      {"own ID taken", event(EventKind::duplicate_node_id, kSelf), kOptional, 1U << 1U},
      {"mandatory lost", event(EventKind::heartbeat_lost, 5), kMandatory, 1U << 2U},
      {"optional lost", event(EventKind::heartbeat_lost, 5), kOptional, 0},
      {"life guarding", event(EventKind::heartbeat_lost, 5, 2), kMandatory, 0},
      {"wrong device type", event(EventKind::boot_result, 5, 'C'), kMandatory, 1U << 3U},
      {"wrong serial", event(EventKind::boot_result, 5, 'O'), kOptional, 1U << 4U},
      {"booted", event(EventKind::boot_result, 5, 0), kMandatory, 0},
      {"no answer", event(EventKind::boot_result, 5, 'B'), kMandatory, 0},
      {"fell silent", silent(event(EventKind::boot_result, 5, 'N')), kMandatory, 0},
      {"configuration", event(EventKind::boot_result, 5, 'J'), kMandatory, 1U << 3U | 1U << 10U},
      {"configuration", event(EventKind::boot_result, 5, 'J'), kOptional, 1U << 10U},
      {"an entry refused", event(EventKind::configuration_error, 5), kOptional, 1U << 10U},
      {"an own PDO", event(EventKind::configuration_error, kSelf), kOptional, 1U << 5U},
      {"lost in a scan", event(EventKind::heartbeat_lost, 5), kScanning, 1U << 6U},
      {"came in a scan", event(EventKind::boot_up, 5), kScanning, 1U << 6U},
      {"boot-up", event(EventKind::boot_up, 5), kOptional, 0},
      {"short PDO", event(EventKind::pdo_length, 5, 1, 8, 7), kOptional, 1U << 9U},
      {"long PDO", event(EventKind::pdo_length, 5, 1, 4, 8), kOptional, 0},
      {"queue full", event(EventKind::command_refused, 0, 1), kOptional, 1U << 11U},
      {"not permitted", event(EventKind::command_refused, 0, 2), kOptional, 0},
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
  state.note(event(EventKind::frames_lost, 0));
  state.note(event(EventKind::queue_full, 0));
  EXPECT_EQ(state.value(), 0x52);
  state.begin();
  EXPECT_EQ(state.value(), 0x00);
}

}  // namespace
}  // namespace linegate::diagnosis
