// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/error_frame.h"

#include <gtest/gtest.h>
#include <linux/can/error.h>

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;
using Kind = BusEvent::Kind;

class ErrorFrame : public testing::Test {
 protected:
  static canfd_frame frame(std::uint32_t classes, std::uint8_t controller = 0, std::uint8_t tec = 0,
                           std::uint8_t rec = 0) {
    canfd_frame raw{};
    raw.can_id = CAN_ERR_FLAG | classes;
    raw.len = CAN_ERR_DLC;
    raw.data[1] = controller;
    raw.data[6] = tec;
    raw.data[7] = rec;
    return raw;
  }
  std::span<const BusEvent> decode(const canfd_frame& raw) {
    events.clear();
    decoder.decode(raw, Instant(Duration(5)), events);
    return events.view();
  }

  ErrorDecoder decoder;
  BusEvents events;
};

TEST_F(ErrorFrame, ControllerStates) {
  struct Row {
    std::uint8_t controller;
    BusState state;
  };
  const Row rows[] = {{CAN_ERR_CRTL_TX_WARNING, BusState::error_warning},
                      {CAN_ERR_CRTL_RX_PASSIVE, BusState::error_passive},
                      {CAN_ERR_CRTL_RX_WARNING, BusState::error_warning},
                      {CAN_ERR_CRTL_TX_PASSIVE | CAN_ERR_CRTL_RX_WARNING, BusState::error_passive},
                      {CAN_ERR_CRTL_ACTIVE, BusState::error_active}};
  for (const Row& row : rows) {
    const auto told = decode(frame(CAN_ERR_CRTL, row.controller, 128, 96));
    ASSERT_EQ(told.size(), 1U);
    EXPECT_EQ(told[0].kind, Kind::state);
    EXPECT_EQ(told[0].state, row.state);
    EXPECT_EQ(told[0].transmit_errors, 128);
    EXPECT_EQ(told[0].receive_errors, 96);
    EXPECT_EQ(told[0].time, Instant(Duration(5)));
  }
}

TEST_F(ErrorFrame, SameStateIsToldOnce) {
  EXPECT_EQ(decode(frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING)).size(), 1U);
  EXPECT_TRUE(decode(frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING)).empty());
}

TEST_F(ErrorFrame, BusOffAndRestart) {
  const auto off = decode(frame(CAN_ERR_BUSOFF | CAN_ERR_CNT, 0, 255, 0));
  ASSERT_EQ(off.size(), 1U);
  EXPECT_EQ(off[0].state, BusState::bus_off);
  EXPECT_EQ(off[0].transmit_errors, 255);
  const auto back = decode(frame(CAN_ERR_RESTARTED));
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].kind, Kind::error);
  EXPECT_EQ(back[0].errors, can::kRestarted);
  EXPECT_EQ(back[1].kind, Kind::state);
  EXPECT_EQ(back[1].state, BusState::error_active);
}

TEST_F(ErrorFrame, ErrorsWithoutChangeOfState) {
  const auto told = decode(frame(CAN_ERR_ACK | CAN_ERR_PROT | CAN_ERR_CNT, 0, 8, 0));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].kind, Kind::error);
  EXPECT_EQ(told[0].errors, can::kNoAcknowledge | can::kProtocol);
  EXPECT_EQ(told[0].transmit_errors, 8);
  EXPECT_EQ(decode(frame(CAN_ERR_TX_TIMEOUT))[0].errors, can::kTxTimeout);
  EXPECT_EQ(decode(frame(CAN_ERR_LOSTARB))[0].errors, can::kLostArbitration);
  EXPECT_EQ(decode(frame(CAN_ERR_TRX))[0].errors, can::kTransceiver);
  EXPECT_EQ(decode(frame(CAN_ERR_BUSERROR))[0].errors, can::kProtocol);
}

TEST_F(ErrorFrame, ReceiveOverflowIsALoss) {
  const auto told = decode(frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW));
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].errors, can::kController);
  EXPECT_EQ(told[1].kind, Kind::frames_lost);
  EXPECT_EQ(told[1].count, 1U);
}

TEST_F(ErrorFrame, NeverMoreEventsThanReserved) {
  for (std::uint32_t classes = 0; classes < 0x400; ++classes) {
    for (unsigned controller = 0; controller < 0x80; ++controller) {
      ErrorDecoder fresh;
      BusEvents told;
      fresh.decode(frame(classes, static_cast<std::uint8_t>(controller)), Instant{}, told);
      ASSERT_LT(told.view().size(), BusEvents::kPerFrame);
    }
  }
}

}  // namespace
}  // namespace linegate::can_bridge
