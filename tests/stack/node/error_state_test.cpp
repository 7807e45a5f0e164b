// SPDX-License-Identifier: Apache-2.0
// The errors of a node: error register by class, the error state machine in both schemes, and the
// effects of bus errors.
#include "stack/emcy/error_state.h"

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using Frames = std::vector<Sent>;

TEST(ErrorRegister, FollowsTheClassOfTheCode) {
  const std::pair<std::uint16_t, int> table[] = {
      {0x0000, 0x00}, {0x1000, 0x01}, {0x2000, 0x03}, {0x2110, 0x03}, {0x2310, 0x03},
      {0x3000, 0x05}, {0x3220, 0x05}, {0x4000, 0x09}, {0x4210, 0x09}, {0x5000, 0x01},
      {0x6000, 0x01}, {0x6200, 0x01}, {0x6310, 0x01}, {0x7000, 0x01}, {0x8000, 0x01},
      {0x8110, 0x11}, {0x8130, 0x11}, {0x8150, 0x11}, {0x8210, 0x11}, {0x8250, 0x11},
      {0x9000, 0x01}, {0xF000, 0x01}, {0xFF00, 0x21}, {0xFF55, 0x21}};
  for (const auto& [code, bits] : table) {
    EXPECT_EQ(emcy::register_of(code), bits) << std::hex << code;
  }
}

TEST(ErrorState, ABitStaysAsLongAsAnErrorNeedsIt) {
  emcy::ErrorState state;
  EXPECT_TRUE(state.error_free());
  std::uint8_t present = state.begin(0x2310, 0x80);
  EXPECT_EQ(present, 0x83);
  present = state.begin(0x2000, present);
  present = state.begin(0x4210, present);
  EXPECT_EQ(present, 0x8B);
  EXPECT_EQ(state.errors(), 3U);
  present = state.end(0x2310, present);
  EXPECT_EQ(present, 0x8B);
  present = state.end(0x2000, present);
  EXPECT_EQ(present, 0x89);
  present = state.end(0x4210, present);
  EXPECT_EQ(present, 0x80) << "other bits remain";
  EXPECT_TRUE(state.error_free());
}

class ErrorStateTest : public NodeTest {
 protected:
  void make(ErrorScheme scheme) {
    node = std::make_unique<Node>(
        example_dictionary(), Options{.node_id = kNodeId, .error_scheme = scheme}, events, nullptr);
    boot_and_start();
  }
  void bus(can::BusState state, Duration when) {
    node->bus_event({.state = state, .time = at(when)});
  }

  static constexpr std::array<std::byte, 5> kInfo{std::byte{1}, std::byte{2}, std::byte{3},
                                                  std::byte{4}, std::byte{5}};
};

TEST_F(ErrorStateTest, OneErrorResetWhenTheLastHasGone) {
  make(ErrorScheme::number);
  EXPECT_TRUE(node->error_free());
  EXPECT_EQ(node->set_error(0x4210, kInfo, at(1ms)), emcy::SendResult::sent);
  EXPECT_EQ(node->set_error(0x3120, {}, at(1ms)), emcy::SendResult::sent);
  EXPECT_FALSE(node->error_free());
  const Frames set{{at(1ms), 0x085, {0x10, 0x42, 0x09, 1, 2, 3, 4, 5}},
                   {at(1ms), 0x085, {0x20, 0x31, 0x0D, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(1ms)), set);
  EXPECT_EQ(number(0x1003, 0), 2U);
  EXPECT_EQ(number(0x1003, 2), 0x0201'4210U);
  EXPECT_TRUE(node->reset_error(0x4210, {}, at(2ms)));
  EXPECT_TRUE(drain(at(2ms)).empty());
  EXPECT_EQ(number(0x1001, 0), 0x05U) << "also without an EMCY";
  EXPECT_FALSE(node->reset_error(0x4210, {}, at(2ms))) << "no error of that class";
  EXPECT_TRUE(node->reset_error(0x3120, {}, at(3ms)));
  EXPECT_EQ(drain(at(3ms)), (Frames{{at(3ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}}));
  EXPECT_TRUE(node->error_free());
}

TEST_F(ErrorStateTest, ErrorsOfTheApplicationGoThroughTheStateMachine) {
  make(ErrorScheme::number);
  EXPECT_EQ(node->report_error(0x2310, 0x80, kInfo, at(1ms)), emcy::SendResult::sent);
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x085, {0x10, 0x23, 0x83, 1, 2, 3, 4, 5}}}));
  EXPECT_EQ(number(0x1003, 1), 0x0201'2310U);
  bus(can::BusState::error_passive, 2ms);
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0x20, 0x81, 0x93, 0, 0, 0, 0, 0}}}));
  EXPECT_EQ(node->report_error(0x2310, 0x20, {}, at(3ms)), emcy::SendResult::sent);
  EXPECT_EQ(drain(at(3ms)), (Frames{{at(3ms), 0x085, {0x10, 0x23, 0x33, 0, 0, 0, 0, 0}}}))
      << "the same error, with other bits";
  EXPECT_EQ(node->report_error(0, 0, {}, at(4ms)), emcy::SendResult::errors_remain);
  EXPECT_TRUE(drain(at(4ms)).empty()) << "error passive remains";
  EXPECT_EQ(number(0x1001, 0), 0x11U);
  bus(can::BusState::error_active, 5ms);
  EXPECT_EQ(drain(at(5ms)), (Frames{{at(5ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}}));
  EXPECT_TRUE(node->error_free());
  EXPECT_EQ(number(0x1003, 0), 3U) << "an error reset is not in the history";
}

TEST_F(ErrorStateTest, AnErrorOfTheApplicationHoldsTheErrorResetOfTheNodeBack) {
  make(ErrorScheme::number);
  node->report_error(0x2310, 0, {}, at(1ms));
  node->report_error(0x4210, 0, {}, at(1ms));
  bus(can::BusState::error_passive, 2ms);
  drain(at(2ms));
  bus(can::BusState::error_active, 3ms);
  EXPECT_TRUE(drain(at(3ms)).empty());
  EXPECT_EQ(number(0x1001, 0), 0x0BU);
  node->end_reported(0x2310, at(4ms));
  EXPECT_TRUE(drain(at(4ms)).empty());
  EXPECT_EQ(number(0x1001, 0), 0x09U);
  EXPECT_EQ(node->report_error(0, 0, kInfo, at(5ms)), emcy::SendResult::sent);
  EXPECT_EQ(drain(at(5ms)), (Frames{{at(5ms), 0x085, {0, 0, 0, 1, 2, 3, 4, 5}}}));
  node->report_error(0x2310, 0, {}, at(6ms));
  nmt(0x82, kNodeId, 7ms);
  EXPECT_TRUE(node->error_free()) << "the node boots without errors";
}

TEST_F(ErrorStateTest, NoMoreErrorsOfTheApplicationThanThereIsRoomFor) {
  make(ErrorScheme::number);
  for (std::size_t i = 0; i < Node::kMostReported; ++i) {
    node->report_error(static_cast<std::uint16_t>(0x5000 + i), 0, {}, at(1ms));
    drain(at(1ms));
  }
  EXPECT_EQ(node->report_error(0x6000, 0, {}, at(2ms)), emcy::SendResult::inhibited);
  EXPECT_EQ(node->report_error(0, 0, {}, at(2ms)), emcy::SendResult::sent);
  EXPECT_EQ(drain(at(2ms)).size(), 1U);
  EXPECT_TRUE(node->error_free());
}

TEST_F(ErrorStateTest, AnErrorResetForEachThatHasGone) {
  make(ErrorScheme::temporary_and_sticky);
  node->set_error(0x4210, kInfo, at(1ms));
  node->set_error(0x3120, kInfo, at(1ms));
  drain(at(1ms));
  EXPECT_TRUE(node->reset_error(0x4210, kInfo, at(2ms)));
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0, 0, 0x05, 1, 2, 3, 4, 5}}}));
  EXPECT_FALSE(node->error_free());
  EXPECT_TRUE(node->reset_error(0x3120, kInfo, at(3ms)));
  EXPECT_EQ(drain(at(3ms)), (Frames{{at(3ms), 0x085, {0, 0, 0, 1, 2, 3, 4, 5}}}));
  EXPECT_TRUE(node->error_free());
}

TEST_F(ErrorStateTest, TemporaryBitsGoAndStickyOnesStayUntilTheReset) {
  make(ErrorScheme::temporary_and_sticky);
  hear(1ms, 0x205, {0x01});
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x085, {0x10, 0x82, 0x11, 0, 0x04, 1, 1, 2}}}));
  EXPECT_EQ(number(0x1003, 1), 0x0400'8210U);
  hear(2ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0, 0, 0, 0, 0x04, 1, 0, 0}}}));
  sdo_write({0x1016, 1}, 4, 0x0007'0064, 3ms);
  hear(3ms, 0x707, {0x05});
  EXPECT_EQ(advance(103ms), (Frames{{at(103ms), 0x085, {0x30, 0x81, 0x11, 0x01, 0x04, 7, 0, 0}}}));
  hear(104ms, 0x707, {0x05});
  EXPECT_EQ(drain(at(104ms)), (Frames{{at(104ms), 0x085, {0, 0, 0, 0, 0x04, 7, 0, 0}}}));
  nmt(0x82, kNodeId, 105ms);
  nmt(0x01, kNodeId, 105ms);
  drain(at(105ms));
  hear(106ms, 0x205, {0x01, 0x00, 0x00});
  EXPECT_EQ(drain(at(106ms)), (Frames{{at(106ms), 0x085, {0x20, 0x82, 0x11, 0, 0x04, 1, 3, 2}}}));
  nmt(0x82, kNodeId, 107ms);
  drain(at(107ms));
  bus(can::BusState::error_passive, 108ms);
  EXPECT_EQ(drain(at(108ms)),
            (Frames{{at(108ms), 0x085, {0x20, 0x81, 0x11, 0x02, 0x01, 0, 0, 0}}}));
}

TEST_F(ErrorStateTest, TheDeviceHasBitsOfItsOwn) {
  make(ErrorScheme::temporary_and_sticky);
  node->set_error_bits(0xFF, 0x3F);
  bus(can::BusState::error_passive, 1ms);
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x085, {0x20, 0x81, 0x11, 0xE2, 0x21, 0, 0, 0}}}));
  node->set_error_bits(0x20, 0x40);
  bus(can::BusState::error_active, 2ms);
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0, 0, 0, 0x20, 0x61, 0, 0, 0}}}));
  nmt(0x82, kNodeId, 3ms);
  drain(at(3ms));
  bus(can::BusState::error_passive, 4ms);
  EXPECT_EQ(drain(at(4ms)), (Frames{{at(4ms), 0x085, {0x20, 0x81, 0x11, 0x02, 0x01, 0, 0, 0}}}));
}

// RPDO 1 has 2 bytes.
TEST_F(ErrorStateTest, TheApplicationMayChangeOrStopWhatTheNodeSendsByItself) {
  struct Censor : Application {
    bool may_send_emcy(std::uint16_t code, std::span<std::byte, 5> info) override {
      asked.push_back(code);
      info[4] = std::byte{0xAB};
      return code != 0x8220;
    }
    std::vector<std::uint16_t> asked;
  };
  Censor censor;
  make(ErrorScheme::number);
  node->set_application(&censor);
  hear(1ms, 0x205, {0x01});
  EXPECT_EQ(drain(at(1ms)), (Frames{{at(1ms), 0x085, {0x10, 0x82, 0x11, 1, 0, 0, 0, 0xAB}}}));
  hear(2ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0xAB}}}));
  EXPECT_EQ(number(0x1003, 0), 1U);
  hear(3ms, 0x205, {0x01, 0x00, 0x00});
  EXPECT_TRUE(drain(at(3ms)).empty());
  EXPECT_EQ(number(0x1001, 0), 0x11U) << "the error is present";
  EXPECT_EQ(number(0x1003, 0), 1U) << "but no EMCY was sent";
  EXPECT_EQ(censor.asked, (std::vector<std::uint16_t>{0x8210, 0, 0x8220}));
  node->set_error(0x2000, kInfo, at(4ms));
  EXPECT_EQ(drain(at(4ms)), (Frames{{at(4ms), 0x085, {0x00, 0x20, 0x13, 1, 2, 3, 4, 5}}}))
      << "the application's own error";
  EXPECT_EQ(censor.asked.size(), 3U);
  node.reset();
}

// EMCY 8110h, 8120h, 8140h
TEST_F(ErrorStateTest, ErrorPassiveIsAnErrorUntilTheBusIsActive) {
  make(ErrorScheme::number);
  bus(can::BusState::error_warning, 1ms);
  EXPECT_TRUE(drain(at(1ms)).empty());
  bus(can::BusState::error_passive, 2ms);
  bus(can::BusState::error_passive, 2ms);
  EXPECT_EQ(drain(at(2ms)), (Frames{{at(2ms), 0x085, {0x20, 0x81, 0x11, 0, 0, 0, 0, 0}}}));
  EXPECT_EQ(node->state(), nmt::State::operational);
  bus(can::BusState::error_warning, 3ms);
  EXPECT_EQ(drain(at(3ms)), (Frames{{at(3ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}}));
}

TEST_F(ErrorStateTest, BusOffObeys1029hAndIsToldWhenItIsOver) {
  make(ErrorScheme::number);
  bus(can::BusState::bus_off, 1ms);
  EXPECT_EQ(node->state(), nmt::State::pre_operational);
  EXPECT_TRUE(drain(at(1ms)).empty());
  bus(can::BusState::error_active, 2ms);
  const Frames told{{at(2ms), 0x085, {0x40, 0x81, 0x11, 0, 0, 0, 0, 0}},
                    {at(2ms), 0x085, {0, 0, 0, 0, 0, 0, 0, 0}}};
  EXPECT_EQ(drain(at(2ms)), told);
  sdo_write({0x1029, 1}, 1, 1, 3ms);
  nmt(0x01, kNodeId, 3ms);
  bus(can::BusState::bus_off, 4ms);
  EXPECT_EQ(node->state(), nmt::State::operational);
}

TEST_F(ErrorStateTest, LostFramesAreToldOnceASecond) {
  make(ErrorScheme::number);
  for (int ms = 0; ms < 1500; ms += 10) {
    node->bus_event({.kind = can::BusEvent::Kind::frames_lost, .count = 3, .time = at(ms * 1ms)});
  }
  EXPECT_EQ(drain(at(1500ms)).size(), 4U) << "8110h and the error reset, twice";
  EXPECT_EQ(number(0x1003, 0), 2U);
  EXPECT_EQ(number(0x1003, 1), 0x8110U);
}

TEST_F(ErrorStateTest, AResetForgetsErrors) {
  make(ErrorScheme::number);
  node->set_error(0x2000, {}, at(1ms));
  nmt(0x82, kNodeId, 2ms);
  EXPECT_TRUE(node->error_free());
  EXPECT_EQ(number(0x1001, 0), 0U);
  EXPECT_FALSE(node->reset_error(0x2000, {}, at(3ms)));
}

// 254 entries: the most that sub-index 0 can count.
TEST_F(ErrorStateTest, TheHistoryHasRoomFor254Errors) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.remove(0x1003).ok());
  ASSERT_TRUE(dictionary
                  .add(testing::array(0x1003, od::DataType::unsigned32, 254, 0,
                                      testing::sub(0, od::DataType::unsigned8, 0)))
                  .ok());
  node =
      std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  boot();
  for (unsigned i = 0; i < 300; ++i) {
    node->set_error(static_cast<std::uint16_t>(0x6100 + i % 256), {}, at(1ms));
    drain(at(1ms));
  }
  EXPECT_EQ(number(0x1003, 0), 254U);
  EXPECT_EQ(number(0x1003, 1), 0x6100U + 299 % 256);
  EXPECT_EQ(number(0x1003, 254), 0x6100U + 46);
  for (const std::uint32_t wrong : {1U, 254U, 255U}) {
    EXPECT_EQ(sdo_write({0x1003, 0}, 1, wrong), 0x0609'0030U);
  }
  EXPECT_EQ(sdo_write({0x1003, 0}, 1, 0), 0U);
  EXPECT_EQ(number(0x1003, 254), 0U);
}

TEST_F(ErrorStateTest, EmcysOf127NodesAreConsumed) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.remove(0x1028).ok());
  ASSERT_TRUE(
      dictionary.add(testing::array(0x1028, od::DataType::unsigned32, 127, 0x8000'0000)).ok());
  node =
      std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  boot();
  for (std::uint8_t id = 1; id <= 127; ++id) {
    if (id != kNodeId) {
      EXPECT_EQ(sdo_write({0x1028, id}, 4, 0x80U + id), 0U);
    }
  }
  testing::pop_events(events);
  for (std::uint32_t id = 1; id <= 127; ++id) {
    hear(1ms, 0x80 + id, {0x00, 0x10, 0x01, 0, 0, 0, 0, 0});
  }
  auto told = testing::pop_events(events);
  EXPECT_EQ(std::ranges::count(told, EventKind::duplicate_node_id, &Event::kind), 1)
      << "one event for the own node-ID";
  std::erase_if(told, [](const Event& event) { return event.kind() != EventKind::emcy; });
  ASSERT_EQ(told.size(), 126U);
  EXPECT_EQ(told.front().node, 1);
  EXPECT_EQ(told.back().node, 127);
}

}  // namespace
}  // namespace linegate::node
