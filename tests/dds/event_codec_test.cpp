// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_codec.h"

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "stack/can/bus_state.h"
#include "stack/line/command.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/lss/assigner.h"
#include "stack/nmt/sleep_protocol.h"
#include "stack/nmt/state.h"
#include "stack/pdo/parameters.h"
#include "stack/routing/post.h"
#include "stack/srdo/receiver.h"

namespace linegate::dds {
namespace {

using nmt::State;
using std::chrono::milliseconds;

EventFields fields(std::uint32_t code, std::uint32_t value,
                   std::initializer_list<unsigned> data = {}) {
  EventFields out{.code = code, .value = value};
  for (const unsigned byte : data)
    out.data[out.length++] = static_cast<std::byte>(byte);
  return out;
}

template <std::size_t Size>
std::array<std::byte, Size> bytes(std::initializer_list<unsigned> values) {
  std::array<std::byte, Size> out{};
  std::ranges::transform(values, out.begin(), [](unsigned value) { return std::byte(value); });
  return out;
}

struct Row {
  EventData data;
  EventFields fields;
};

std::vector<Row> layouts_of_lines() {
  return {
      {event::LineStarted{line::Role::device}, fields(2, 0)},
      {event::LineStopped{}, fields(0, 0)},
      {event::BusState{.state = can::BusState::bus_off,
                       .before = can::BusState::error_passive,
                       .transmit_errors = 255,
                       .receive_errors = 3},
       fields(4, 3, {255, 3})},
      {event::BusError{.errors = can::kProtocol | can::kNoAcknowledge}, fields(0x28, 0)},
      {event::BusError{.errors = can::kProtocol, .suppressed = 0x0403'0201},
       fields(8, 0, {0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4})},
      {event::FramesLost{7}, fields(0, 7)},
      {event::InterfaceFailed{19}, fields(19, 0)},
      {event::InterfaceReady{}, fields(0, 0)},
      {event::ManagerState{.state = manager::ManagerState::running,
                           .before = manager::ManagerState::booting},
       fields(4, 2)},
      {event::FlyingMaster{.state = nmt::FlyingMasterState::slave,
                           .before = nmt::FlyingMasterState::force,
                           .priority = 1},
       fields(5, 6, {1})},
      {event::EventsLost{.first = 0x0102'0304'0506'0708, .last = 9},
       fields(0, 0, {8, 7, 6, 5, 4, 3, 2, 1, 9, 0, 0, 0, 0, 0, 0, 0})},
      {event::ClockStep{milliseconds(70'000)}, fields(0, 70'000)},
      {event::QueueFull{.queue = event::Queue::requests, .lost = 3}, fields(1, 3)},
      {event::LayoutChanged{.inputs = 0x0102'0304'0506'0708, .outputs = 9},
       fields(0, 0, {8, 7, 6, 5, 4, 3, 2, 1, 9, 0, 0, 0, 0, 0, 0, 0})},
      {event::GatewayStarted{4}, fields(0, 4)},
      {event::GatewayReloaded{.changed = 2, .lines = 5}, fields(2, 5)},
      {event::GatewayReloadRefused{3}, fields(0, 3)},
      {event::JournalState{event::JournalCondition::failing, 0x0102'0304, 5},
       fields(2, 5, {4, 3, 2, 1})},
      {event::DdsProcessEnded{event::ProcessEnd::signal, 9, 0x0102'0304, 250},
       fields(2, 9, {4, 3, 2, 1, 250, 0, 0, 0, 0})},
      {event::DdsProcessEnded{event::ProcessEnd::signal, 9, 0x0102'0304, 250,
                              event::DdsProcess::routes},
       fields(2, 9, {4, 3, 2, 1, 250, 0, 0, 0, 1})},
      {event::SdoConnection{.number = 3,
                            .abort = AbortCode::timeout,
                            .client_record = 0x1280,
                            .server_record = 0x1201,
                            .request = 0x681,
                            .response = 0x680,
                            .client = 5,
                            .server = 8,
                            .result = event::ConnectionResult::stale},
       fields(0x0504'0000, 4, {3, 0, 0, 0, 5, 8, 0x80, 0x12, 1, 0x12, 0x81, 6, 0x80, 6})},
  };
}

std::vector<Row> layouts_of_frames() {
  return {
      {event::MalformedFrame{.identifier = 0x585, .length = 2, .data = bytes<8>({0x43, 0x18})},
       fields(0x585, 2, {0x43, 0x18})},
      {event::MalformedFrame{.identifier = 0x585,
                             .length = 12,
                             .data = bytes<8>({1, 2, 3, 4, 5, 6, 7, 8}),
                             .suppressed = 265},
       fields(0x585, 12, {1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 0, 0})},
      {event::MalformedFrame{
           .identifier = 0x705, .length = 1, .data = bytes<8>({5}), .suppressed = 1},
       fields(0x705, 1, {5, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0})},
      {event::CanFrame{.identifier = 0x150, .length = 2, .data = bytes<16>({0x11, 0x22})},
       fields(0x150, 2, {0x11, 0x22})},
      {event::CanFrame{.identifier = 0x150, .suppressed = 7, .extended = true},
       fields(0x8000'0150, 0x0007'0000)},
      {event::CanFrame{.identifier = 0x150, .length = 3, .remote = true}, fields(0x150, 0x103)},
      {event::CanFrame{.identifier = 0x150,
                       .length = 20,
                       .fd = true,
                       .piece = 1,
                       .data = bytes<16>({1, 2, 3, 4})},
       fields(0x150, 0x614, {1, 2, 3, 4})},
      {event::ForeignSdo{0x605}, fields(0x605, 0)},
      {event::PdoLength{.number = 300, .mapped = 8, .received = 7}, fields(300, 8, {7})},
      {event::PdoTimeout{.number = 2, .deadline = milliseconds(500)}, fields(2, 500)},
      {event::PdoRecovered{2}, fields(2, 0)},
      {event::PdoMapping{.number = 1, .kind = pdo::PdoKind::tpdo, .complete = true},
       fields(1, 0, {1})},
      {event::PdoMapping{.number = 2, .kind = pdo::PdoKind::rpdo, .complete = false},
       fields(2, 1, {0})},
      {event::SyncLost{std::chrono::microseconds(10'000)}, fields(0, 10'000)},
      {event::SdoAbort{.abort = AbortCode::no_object, .index = 0x1018, .sub = 4},
       fields(0x0602'0000, 0, {0x18, 0x10, 4})},
      {event::SdoAbort{
           .abort = AbortCode::no_object, .index = 0x1018, .sub = 4, .suppressed = 0x0102},
       fields(0x0602'0000, 0, {0x18, 0x10, 4, 0, 0, 0, 0, 0, 2, 1, 0, 0})},
      {event::SdoTransfer{.size = 2,
                          .suppressed = 99,
                          .index = 0x1017,
                          .download = true,
                          .data = bytes<13>({0xFA, 0})},
       fields(0x0063'0001, 2, {0x17, 0x10, 0, 0xFA, 0})},
      {event::SdoTransfer{.size = 5000,
                          .index = 0x1F50,
                          .sub = 1,
                          .data = bytes<13>({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13})},
       fields(0, 5000, {0x50, 0x1F, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13})},
      {event::ObjectWritten{
           .size = 2, .suppressed = 40, .index = 0x2100, .sub = 1, .data = bytes<13>({7, 0})},
       fields(40, 2, {0x00, 0x21, 1, 7, 0})},
      {event::RoutingUnanswered{.suppressed = 40,
                                .source = 1,
                                .target = 0x0203,
                                .index = 0x1018,
                                .sub = 6,
                                .target_node = 5,
                                .interface = 255},
       fields(40, 0, {1, 0, 3, 2, 5, 255, 0x18, 0x10, 6})},
      {event::SleepState{.phase = nmt::SleepPhase::asleep,
                         .before = nmt::SleepPhase::silent,
                         .cause = nmt::SleepCause::time},
       fields(4, 3, {2})},
      {event::SrdoState{.suppressed = 40, .fault = srdo::Fault::validation_time, .number = 64},
       fields(64, 5, {40, 0, 0, 0})},
  };
}

std::vector<Row> layouts_of_nodes() {
  return {
      {event::OwnState{
           .state = State::pre_operational, .before = State::initialising, .node_id = 9},
       fields(0x7F, 0, {9})},
      {event::BootUp{}, fields(0, 0)},
      {event::NodeState{.state = State::operational, .before = State::unknown}, fields(5, 0xFF)},
      {event::HeartbeatLost{.by = event::ErrorControl::heartbeat, .time = milliseconds(500)},
       fields(0, 500)},
      {event::HeartbeatLost{.by = event::ErrorControl::node_guarding, .time = milliseconds(300)},
       fields(1, 300)},
      {event::HeartbeatLost{.by = event::ErrorControl::life_guarding, .time = milliseconds(300)},
       fields(2, 300)},
      {event::HeartbeatRecovered{State::stopped}, fields(4, 0)},
      {event::BootResult{}, fields(0, 0)},
      {event::BootResult{.letter = 'K'}, fields('K', 0)},
      {event::BootResult{.letter = 'J',
                         .cause = event::BootCause::abort,
                         .sub = 2,
                         .index = 0x1017,
                         .abort = AbortCode::no_object,
                         .expected = 3},
       fields('J', 0x0602'0000, {0x17, 0x10, 2, 1, 3, 0, 0, 0})},
      {event::BootResult{.letter = 'M',
                         .cause = event::BootCause::value,
                         .sub = 2,
                         .index = 0x1018,
                         .found = 0x1234'5678,
                         .expected = 0x0403'0201},
       fields('M', 0x1234'5678, {0x18, 0x10, 2, 2, 1, 2, 3, 4})},
      {event::BootResult{.letter = 'R', .cause = event::BootCause::written, .index = 0x6083},
       fields('R', 0, {0x83, 0x60, 0, 3, 0, 0, 0, 0})},
      {event::Emcy{
           .code = 0x8130, .error_register = 0x11, .manufacturer = bytes<5>({1, 2, 3, 4, 5})},
       fields(0x8130, 0x11, {1, 2, 3, 4, 5})},
      {event::EmcySent{
           .code = 0x5000, .error_register = 1, .manufacturer = bytes<5>({0, 0, 0, 0, 9})},
       fields(0x5000, 1, {0, 0, 0, 0, 9})},
      {event::ConfigurationError{.abort = AbortCode::invalid_value, .index = 0x1A01, .sub = 1},
       fields(0x0609'0030, 0, {0x01, 0x1A, 1})},
      {event::UnexpectedNode{State::operational}, fields(5, 0)},
      {event::SpontaneousChange{.state = State::initialising, .before = State::operational},
       fields(0, 5)},
      {event::SharedNodeId{
           .evidence = event::SharedIdEvidence::two_responses, .sub = 4, .index = 0x1018},
       fields(1, 0, {0x18, 0x10, 4})},
      {event::SharedNodeId{event::SharedIdEvidence::two_states}, fields(2, 0)},
      {event::SharedNodeId{event::SharedIdEvidence::two_periods}, fields(3, 0)},
      {event::SharedNodeId{event::SharedIdEvidence::unchanged_after_boot_up}, fields(4, 0)},
      {event::SharedNodeId{event::SharedIdEvidence::too_many_heartbeats}, fields(5, 0)},
      {event::DuplicateNodeId{State::unknown}, fields(0xFF, 0)},
      {event::NmtCommand{nmt::Command::reset_node}, fields(0x81, 0)},
      {event::OwnReset{nmt::Command::reset_communication}, fields(0x82, 0)},
      {event::TimeReceived{Duration(0x0102'0304'0506'0708)},
       fields(0, 0, {8, 7, 6, 5, 4, 3, 2, 1})},
      {event::NodeScanned{.abort = AbortCode::timeout, .objects = 12}, fields(0x0504'0000, 12)},
      {event::LssResult{.verdict = lss::Verdict::node_id_refused,
                        .error = 255,
                        .specific = 7,
                        .address = {{0x4C47, 0x4020, 0x10000, 0x1F5}}},
       fields(4, 0x07FF, {0x47, 0x4C, 0, 0, 0x20, 0x40, 0, 0, 0, 0, 1, 0, 0xF5, 1, 0, 0})},
      {event::LssResult{.verdict = lss::Verdict::nobody_found}, fields(8, 0)},
  };
}

std::vector<Row> layouts_of_masters() {
  return {
      {event::ForeignManager{.evidence = event::ManagerEvidence::nmt_command,
                             .command = nmt::Command::stop,
                             .addressee = 5},
       fields(1, 2, {5})},
      {event::ForeignManager{.evidence = event::ManagerEvidence::flying_master, .identifier = 0x76},
       fields(2, 0x76, {0})},
      {event::ForeignManager{.evidence = event::ManagerEvidence::sleep, .identifier = 0x690},
       fields(3, 0x690, {0})},
  };
}

std::vector<Row> layouts_of_requests() {
  return {
      {event::OutputRefused{.refusal = line::OutputRefusal::not_armed, .group = 3}, fields(6, 3)},
      {event::OutputRefused{
           .refusal = line::OutputRefusal::stale_layout, .group = 0xFFFF, .suppressed = 98},
       fields(2, 0xFFFF, {0, 0, 0, 0, 0, 0, 0, 0, 98, 0, 0, 0})},
      {event::OutputRefused{
           .refusal = line::OutputRefusal::not_armed, .group = 3, .client = 0x0102},
       fields(6, 3, {2, 1, 0, 0})},
      {event::OutputArmed{.group = 3, .watchdog = milliseconds(100)}, fields(100, 3)},
      {event::OutputArmed{.group = 3, .client = 9}, fields(0, 3, {9, 0, 0, 0})},
      {event::CommandRefused{.refusal = line::Refusal::busy,
                             .command = line::CommandKind::nmt,
                             .suppressed = 3,
                             .client = 4},
       fields(1, 6, {4, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0})},
      {event::CommandAccepted{.command = line::CommandKind::sdo_write,
                              .sub = 1,
                              .index = 0x1017,
                              .client = 5,
                              .suppressed = 6},
       fields(1, 5, {0x17, 0x10, 1, 0, 0, 0, 0, 0, 6, 0, 0, 0})},
      {event::OutputOwner{.group = 3, .client = 4, .before = 5}, fields(3, 4, {5, 0, 0, 0})},
      {event::ClientLimited{.client = 1, .delayed = 2, .refused = 3, .replaced = 4},
       fields(1, 2, {3, 0, 0, 0, 4, 0, 0, 0})},
      {event::OutputWatchdog{.group = 3, .reactions = line::kZeroOutputs | line::kSendEmcy},
       fields(0x21, 3)},
      {event::CommandRefused{.refusal = line::Refusal::bad_request,
                             .command = line::CommandKind::output_write,
                             .suppressed = 2},
       fields(3, 4, {0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0})},
      {event::CommandProgress{.command = line::CommandKind::program, .done = 889, .total = 200'010},
       fields(16, 889, {0x4A, 0x0D, 3, 0})},
      {event::RoutingRefused{.abort = AbortCode::invalid_value,
                             .source = 1,
                             .target = 0x0203,
                             .target_node = 12,
                             .service = routing::RoutedService::emcy},
       fields(0x0609'0030, 0, {1, 0, 3, 2, 12, 1})},
      {event::EmcyRouted{.code = 0x8130,
                         .source = 0x0203,
                         .source_node = 12,
                         .error_register = 0x11,
                         .hops = 2,
                         .number = 9},
       fields(0x8130, 0, {0x11, 3, 2, 12, 2, 9})},
      {event::RoutingOpened{.connection = 0x0001'0003,
                            .suppressed = 40,
                            .source = 1,
                            .target = 0x0203,
                            .target_node = 5,
                            .interface = 2,
                            .gateway = 9,
                            .hops = 4},
       fields(0x0001'0003, 40, {1, 0, 3, 2, 5, 2, 9, 4})},
      {event::RoutingEnded{.connection = 0x0403'0201,
                           .abort = AbortCode::timeout,
                           .bytes = 4,
                           .source = 1,
                           .target = 0x0203,
                           .index = 0x1018,
                           .sub = 6,
                           .target_node = 5,
                           .interface = 2,
                           .gateway = 9,
                           .service = event::SdoService::download},
       fields(0x0504'0000, 4, {1, 0, 3, 2, 5, 2, 9, 2, 0x18, 0x10, 6, 1, 2, 3, 4})},
  };
}

std::vector<Row> layouts() {
  std::vector<Row> out;
  for (const auto& part : {layouts_of_lines(), layouts_of_frames(), layouts_of_nodes(),
                           layouts_of_masters(), layouts_of_requests()})
    out.insert(out.end(), part.begin(), part.end());
  return out;
}

TEST(EventCodec, LayoutsAreThoseOfTheContract) {
  std::set<EventKind> kinds;
  for (const Row& row : layouts()) {
    kinds.insert(kind(row.data));
    EXPECT_EQ(pack(row.data), row.fields) << name(kind(row.data));
    EXPECT_EQ(unpack(kind(row.data), row.fields), row.data) << name(kind(row.data));
  }
  EXPECT_EQ(kinds.size(), kEventKinds);
}

TEST(EventCodec, AnEmcyOfCanopenFdHasMoreFields) {
  const EventData data = event::Emcy{.code = 0x8130,
                                     .error_register = 0x11,
                                     .manufacturer = bytes<5>({1, 2, 3, 4, 5}),
                                     .fd = {.any = true,
                                            .logical_device = 2,
                                            .status = 0x31,
                                            .profile = 402,
                                            .time_of_day = bytes<6>({6, 7, 8, 9, 10, 11})}};
  const EventFields expected =
      fields(0x8130, 0x11, {1, 2, 3, 4, 5, 2, 0x92, 0x01, 0x31, 6, 7, 8, 9, 10, 11});
  EXPECT_EQ(pack(data), expected);
  EXPECT_EQ(unpack(kind(data), expected), data);
}

TEST(EventCodec, ZeroInEachMemberComesBack) {
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    const EventData data = empty_event_data(static_cast<EventKind>(i));
    EXPECT_EQ(unpack(kind(data), pack(data)), data) << name(kind(data));
  }
}

// The highest value in each member.
constexpr std::uint8_t kHighest8 = 0xFF;
constexpr std::uint16_t kHighest16 = 0xFFFF;
constexpr std::uint32_t kHighest32 = 0xFFFF'FFFF;
constexpr std::uint64_t kHighest64 = std::numeric_limits<std::uint64_t>::max();
constexpr AbortCode kHighestAbort{kHighest32};
constexpr State kHighestState{kHighest8};
constexpr nmt::Command kHighestCommand{kHighest8};
constexpr milliseconds kLongest{kHighest32};

template <std::size_t Size>
std::array<std::byte, Size> full() {
  std::array<std::byte, Size> out;
  out.fill(std::byte{kHighest8});
  return out;
}

std::vector<EventData> highest_of_lines_and_own_node() {
  constexpr can::BusState kBus{kHighest8};
  constexpr manager::ManagerState kManager{kHighest8};
  return {
      event::LineStarted{line::Role{kHighest8}},
      event::LineStopped{},
      event::BusState{kBus, kBus, kHighest8, kHighest8},
      event::BusError{kHighest32, kHighest32},
      event::FramesLost{kHighest32},
      event::InterfaceFailed{kHighest32},
      event::InterfaceReady{},
      event::ManagerState{kManager, kManager},
      event::OwnState{kHighestState, kHighestState, kHighest8},
      event::EmcySent{
          kHighest16, kHighest8, full<5>(), {true, kHighest8, kHighest8, kHighest16, full<6>()}},
      event::SyncLost{std::chrono::microseconds(kHighest32)},
      event::MalformedFrame{kHighest32, kHighest8, full<8>(), kHighest32},
      event::CanFrame{.identifier = 0x1FFF'FFFF,
                      .suppressed = kHighest16,
                      .length = 64,
                      .extended = true,
                      .fd = true,
                      .piece = 3,
                      .data = full<16>()},
      event::CanFrame{.identifier = 0x1FFF'FFFF, .length = 8, .extended = true, .remote = true},
      event::EventsLost{kHighest64, kHighest64},
      event::ClockStep{kLongest},
      event::QueueFull{event::Queue{kHighest8}, kHighest32},
      event::LayoutChanged{kHighest64, kHighest64},
      event::DuplicateNodeId{kHighestState},
      event::ObjectWritten{kHighest32, kHighest32, kHighest16, kHighest8, full<13>()},
      event::OwnReset{kHighestCommand},
      event::TimeReceived{Duration::max()},
      event::GatewayStarted{kHighest32},
      event::GatewayReloaded{kHighest32, kHighest32},
      event::GatewayReloadRefused{kHighest32},
      event::JournalState{event::JournalCondition{kHighest8}, kHighest32, kHighest32},
      event::DdsProcessEnded{event::ProcessEnd{kHighest8}, kHighest32, kHighest32, kHighest32,
                             event::DdsProcess{kHighest8}},
  };
}

std::vector<EventData> highest_of_nodes_and_requests() {
  return {
      event::BootUp{},
      event::NodeState{kHighestState, kHighestState},
      event::HeartbeatLost{event::ErrorControl{kHighest8}, kLongest},
      event::HeartbeatRecovered{kHighestState},
      event::BootResult{.letter = static_cast<char>(kHighest8),
                        .cause = event::BootCause::abort,
                        .sub = kHighest8,
                        .index = kHighest16,
                        .abort = kHighestAbort,
                        .expected = kHighest32},
      event::BootResult{.letter = static_cast<char>(kHighest8),
                        .cause = event::BootCause::written,
                        .sub = kHighest8,
                        .index = kHighest16,
                        .found = kHighest32,
                        .expected = kHighest32},
      event::Emcy{
          kHighest16, kHighest8, full<5>(), {true, kHighest8, kHighest8, kHighest16, full<6>()}},
      event::ConfigurationError{kHighestAbort, kHighest16, kHighest8},
      event::PdoLength{kHighest16, kHighest16, kHighest8},
      event::PdoTimeout{kHighest16, kLongest},
      event::PdoRecovered{kHighest16},
      event::UnexpectedNode{kHighestState},
      event::ForeignSdo{kHighest32},
      event::SdoAbort{kHighestAbort, kHighest16, kHighest8, kHighest32},
      event::OutputRefused{line::OutputRefusal{kHighest8}, kHighest16, kHighest32, kHighest32},
      event::OutputArmed{kHighest16, kLongest, kHighest32},
      event::OutputWatchdog{kHighest16, kHighest8},
      event::CommandRefused{line::Refusal{kHighest8}, line::CommandKind{kHighest8}, kHighest32,
                            kHighest32},
      event::CommandAccepted{line::CommandKind{kHighest8}, kHighest8, kHighest16, kHighest32,
                             kHighest32},
      event::OutputOwner{kHighest16, kHighest32, kHighest32, kHighest32},
      event::ClientLimited{kHighest32, kHighest32, kHighest32, kHighest32},
      event::NmtCommand{kHighestCommand},
      event::SdoTransfer{kHighest32, kHighest16, kHighest16, kHighest8, true, full<13>()},
      event::PdoMapping{kHighest16, pdo::PdoKind::tpdo, true},
      event::RoutingRefused{kHighestAbort, kHighest16, kHighest16, kHighest8,
                            routing::RoutedService{kHighest8}},
      event::EmcyRouted{kHighest16, kHighest16, kHighest8, kHighest8, kHighest8, kHighest8},
      event::RoutingOpened{kHighest32, kHighest32, kHighest16, kHighest16, kHighest8, kHighest8,
                           kHighest8, kHighest8},
      event::RoutingEnded{kHighest32, kHighestAbort, kHighest32, kHighest16, kHighest16, kHighest16,
                          kHighest8, kHighest8, kHighest8, kHighest8, event::SdoService{kHighest8}},
      event::RoutingUnanswered{kHighest32, kHighest16, kHighest16, kHighest16, kHighest8, kHighest8,
                               kHighest8},
      event::SrdoState{kHighest32, srdo::Fault{kHighest8}, kHighest8},
      event::SdoConnection{kHighest32, kHighestAbort, kHighest16, kHighest16, kHighest16,
                           kHighest16, kHighest8, kHighest8, event::ConnectionResult{kHighest8}},
      event::SleepState{nmt::SleepPhase{kHighest8}, nmt::SleepPhase{kHighest8},
                        nmt::SleepCause{kHighest8}},
      event::NodeScanned{kHighestAbort, kHighest32},
      event::CommandProgress{line::CommandKind{kHighest8}, kHighest32, kHighest32},
      event::LssResult{lss::Verdict{kHighest8},
                       kHighest8,
                       kHighest8,
                       {{kHighest32, kHighest32, kHighest32, kHighest32}}},
      event::ForeignManager{event::ManagerEvidence::nmt_command, kHighestCommand, kHighest8},
      event::FlyingMaster{nmt::FlyingMasterState{kHighest8}, nmt::FlyingMasterState{kHighest8},
                          kHighest8},
      event::ForeignManager{.evidence = event::ManagerEvidence::flying_master,
                            .addressee = kHighest8,
                            .identifier = kHighest32},
      event::SpontaneousChange{kHighestState, kHighestState},
      event::SharedNodeId{event::SharedIdEvidence::two_responses, kHighest8, kHighest16},
      event::SharedNodeId{event::SharedIdEvidence{kHighest8}},
  };
}

TEST(EventCodec, TheHighestValueOfEachMemberComesBack) {
  std::set<EventKind> kinds;
  for (const auto& part : {highest_of_lines_and_own_node(), highest_of_nodes_and_requests()}) {
    for (const EventData& data : part) {
      kinds.insert(kind(data));
      EXPECT_EQ(unpack(kind(data), pack(data)), data) << name(kind(data));
    }
  }
  EXPECT_EQ(kinds.size(), kEventKinds);
}

TEST(EventCodec, AKindOfANewerGatewayIsNoData) {
  EXPECT_FALSE(unpack(static_cast<EventKind>(kEventKinds), {}));
  EXPECT_FALSE(unpack(static_cast<EventKind>(0xFF), fields(1, 2, {3})));
}

TEST(EventCodec, MissingDataCountAsZero) {
  EXPECT_EQ(unpack(EventKind::own_state, fields(5, 4)),
            EventData(event::OwnState{.state = State::operational, .before = State::stopped}));
  EXPECT_EQ(unpack(EventKind::sdo_abort, fields(0, 0, {0x18, 0x10})),
            EventData(event::SdoAbort{.index = 0x1018}));
  EXPECT_EQ(unpack(EventKind::lss_result, fields(8, 0, {1, 2, 3})),
            EventData(event::LssResult{.verdict = lss::Verdict::nobody_found}));
  EXPECT_EQ(unpack(EventKind::bus_error, fields(8, 0, {0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3})),
            EventData(event::BusError{.errors = 8}));
}

TEST(EventCodec, ABootResultWithAnUnknownCauseIsItsLetterAlone) {
  const EventData letter = event::BootResult{.letter = 'J'};
  EXPECT_EQ(unpack(EventKind::boot_result, fields('J', 1, {0x17, 0x10, 0, 4, 0, 0, 0, 0})), letter);
  EXPECT_EQ(unpack(EventKind::boot_result, fields('J', 1, {0x17, 0x10, 0, 0, 0, 0, 0, 0})), letter);
  EXPECT_EQ(unpack(EventKind::boot_result, fields('J', 1, {0x17, 0x10, 0, 1, 0, 0, 0})), letter);
}

TEST(EventCodec, SuppressedTransfersEndAtSixteenBits) {
  const EventFields packed = pack(event::SdoTransfer{.suppressed = kHighest16});
  EXPECT_EQ(packed.code, 0xFFFF'0000U);
}

}  // namespace
}  // namespace linegate::dds
