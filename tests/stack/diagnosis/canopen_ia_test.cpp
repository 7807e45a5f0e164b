// SPDX-License-Identifier: Apache-2.0
#include "stack/can/bus_state.h"

#include "tests/stack/diagnosis/canopen_ia_fixture.h"

namespace linegate::diagnosis {
namespace {

TEST_F(CanopenIaTest, TheStatusOfTheDevice) {  // 1018h
  make({.revision = 0x0003'0007, .serial = 0x1234'5678});
  EXPECT_EQ(read(0x5F40, 0), 5U);
  EXPECT_EQ(read(0x5F40, 1), 127U);
  EXPECT_EQ(read(0x5F40, 2), 5U);
  EXPECT_EQ(read(0x5F40, 4), 0x0703'0200U) << "a manager, version 3.7";
  const auto serial = dictionary_.read({0x5F40, 5});
  ASSERT_TRUE(serial);
  ASSERT_EQ(serial->size(), 16U);
  EXPECT_EQ(load_le(serial->first(8)), 0x1234'5678U);
  EXPECT_EQ(write(0x5F40, 1, 5, 1), AbortCode::read_only);
}

TEST_F(CanopenIaTest, BitsOfTheHardwareState) {
  make({});
  EXPECT_EQ(read(0x5F40, 3), 0x01U);
  bus(can::BusState::error_passive);
  EXPECT_EQ(read(0x5F40, 3), 0x05U);
  bus(can::BusState::bus_off);
  EXPECT_EQ(read(0x5F40, 3), 0x81U);
  bus(can::BusState::error_active);
  diagnosis_.emitted({.data = event::BusError{}});
  diagnosis_.emitted({.data = event::FramesLost{}});
  EXPECT_EQ(read(0x5F40, 3), 0x0BU);
  facts_.own = nmt::State::initialising;
  EXPECT_EQ(read(0x5F40, 3), 0x0AU);
}

TEST_F(CanopenIaTest, TheHardwareStateHasWhatTheInterfaceSends) {
  make({});
  transmission_.waiting = true;
  EXPECT_EQ(read(0x5F40, 3), 0x41U);
  transmission_ = {.overrun = true};
  EXPECT_EQ(read(0x5F40, 3), 0x11U);
  transmission_ = {.fd = true};
  EXPECT_EQ(read(0x5F40, 3), 0x21U);
}

TEST_F(CanopenIaTest, TheLastStateOfEachNode) {
  make({});
  EXPECT_EQ(dictionary_.read({0x5F44, 5}).error(), to_error(AbortCode::no_data));
  diagnosis_.emitted({.node = 5, .data = event::Emcy{.code = 0x8110}});
  EXPECT_EQ(read(0x5F44, 5), 0x80U);
  EXPECT_EQ(read(0x5F44, 0), 127U);
}

TEST_F(CanopenIaTest, KeepOperationalIsWrittenTheRestIsAsItIs) {
  make({});
  EXPECT_EQ(read(0x5F41, 4), kFixedControl);
  EXPECT_FALSE(records_->keep_operational());
  EXPECT_EQ(write(0x5F41, 4, kFixedControl | kKeepOperational, 4), AbortCode::none);
  EXPECT_TRUE(records_->keep_operational());
  EXPECT_EQ(read(0x5F41, 4), kFixedControl | 1U);
  EXPECT_EQ(write(0x5F41, 4, 0, 4), AbortCode::invalid_value);
  EXPECT_TRUE(records_->keep_operational());
}

TEST_F(CanopenIaTest, CommandsWaitUntilTheAccessIsOver) {
  make({});
  EXPECT_EQ(write(0x5F4A, 1, 0x0502, 2), AbortCode::none);
  EXPECT_EQ(write(0x5F4A, 1, 0x0001, 2), AbortCode::none);
  EXPECT_EQ(write(0x5F41, 1, 129, 1), AbortCode::none);
  EXPECT_EQ(write(0x5F41, 1, 130, 1), AbortCode::none);
  std::vector<std::pair<nmt::Command, unsigned>> orders;
  for (CanopenIa::Order order; records_->take(order);) {
    orders.emplace_back(order.command, order.node);
  }
  const std::vector<std::pair<nmt::Command, unsigned>> wanted{
      {nmt::Command::stop, 5},
      {nmt::Command::start, 0},
      {nmt::Command::reset_communication, kOwnNode},
      {nmt::Command::reset_node, kOwnNode}};
  EXPECT_EQ(orders, wanted);
}

TEST_F(CanopenIaTest, WhatIsNoCommandIsRefused) {
  make({});
  EXPECT_EQ(write(0x5F41, 1, 131, 1), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F4A, 1, 0x0503, 2), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F4A, 1, 0x8001, 2), AbortCode::invalid_value) << "128 is not a node-ID";
  EXPECT_EQ(dictionary_.read({0x5F4A, 1}).error(), to_error(AbortCode::write_only));
  for (std::size_t i = 0; i < CanopenIa::kOrders; ++i) {
    EXPECT_EQ(write(0x5F4A, 1, 0x0501, 2), AbortCode::none);
  }
  EXPECT_EQ(write(0x5F4A, 1, 0x0501, 2), AbortCode::device_state);
}

TEST_F(CanopenIaTest, WhatIsNotThereIsNoSubIndex) {  // a sub-index of CiA 447
  make({});
  EXPECT_EQ(dictionary_.read({0x5F41, 3}).error(), to_error(AbortCode::no_sub_index));
  EXPECT_EQ(write(0x5F41, 3, 0, 4), AbortCode::no_sub_index);
}

TEST_F(CanopenIaTest, TheSleepObjectionIsWritten) {  // 5F41h:02h
  make({});
  EXPECT_FALSE(records_->settings().sleep_objection);
  EXPECT_EQ(write(0x5F41, 2, 2, 1), AbortCode::invalid_value);
  EXPECT_EQ(write(0x5F41, 2, 1, 1), AbortCode::none);
  EXPECT_TRUE(records_->settings().sleep_objection);
}

TEST_F(CanopenIaTest, TheRecordsHaveRoomBesideTheOthers) {
  EXPECT_TRUE(is_free_for_records(0x5F40));
  EXPECT_FALSE(is_free_for_records(0x5F20));
  EXPECT_TRUE(is_free_for_records(0x5F73));
  EXPECT_FALSE(is_free_for_records(0x5F74)) << "the last would be 5F80h";
  EXPECT_TRUE(is_free_for_records(0x5FF3));
  EXPECT_FALSE(is_free_for_records(0x5FF4)) << "the last would be 6000h";
}

TEST_F(CanopenIaTest, OfASlaveAtAnotherBase) {
  make({.base = 0x5F60, .manager = false});
  EXPECT_FALSE(dictionary_.has_object(0x5F40));
  EXPECT_EQ(read(0x5F60, 4), 0x0000'0100U) << "a device";
  EXPECT_EQ(write(0x5F6A, 1, 0x0501, 2), AbortCode::local_control);
  EXPECT_EQ(write(0x5F61, 1, 130, 1), AbortCode::none) << "a device may reset itself";
}

}  // namespace
}  // namespace linegate::diagnosis
