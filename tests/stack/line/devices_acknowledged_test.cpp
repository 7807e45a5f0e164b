// SPDX-License-Identifier: Apache-2.0
// A line in the role device: a command is answered when the bus has acknowledged its frame.
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/under_way_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class AcknowledgedDevices : public AcknowledgedLine {
 protected:
  // Devices 5 and 6 in Operational, with all frames acknowledged.
  void run() {
    LineConfig config = config_of_devices();
    for (const std::uint8_t id : {std::uint8_t{5}, std::uint8_t{6}}) {
      config.devices.push_back({.id = id,
                                .name = "axis" + std::to_string(id),
                                .device = *eds::load(kDeviceFile, "axis.eds", id).value});
    }
    make(std::move(config));
    line_->expect_acknowledgements();
    line_->start(now_);
    hear(0x000, {0x01, 0x00});
    line_->advance(now_);
    hand_out();
    acknowledge_all();
    events();
  }
  void write_status(std::uint8_t value) {
    line_->execute({.request = SingleOutput{.data = {std::byte{value}, std::byte{}}}}, now_);
  }
  void trigger() { line_->execute({.request = PdoTrigger{.node = 5, .number = 1}}, now_); }
  void send_emcy(std::uint16_t code) {
    line_->execute({.request = EmcySend{.node = 6, .code = code}}, now_);
  }
  static ReplyData way(PdoWait wait) { return WrittenByPdo{1, wait}; }
};

TEST_F(AcknowledgedDevices, AValueIsAnsweredWhenItIsOnTheBus) {
  run();
  write_status(4);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("185#040000000000"));
  EXPECT_FALSE(is_answered()) << "only the controller has the frame";
  acknowledge_all();
  EXPECT_EQ(answer().data, way(PdoWait::none));
}

TEST_F(AcknowledgedDevices, AValueIsNotAnsweredByTheFrameOfAnOlderOne) {
  run();
  write_status(4);
  hand_out();
  acknowledge_all();
  EXPECT_TRUE(is_answered());
  write_status(7);
  hand_out();
  write_status(8);
  acknowledge_all();
  EXPECT_TRUE(is_answered()) << "value 7 was on the bus";
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("185#080000000000"));
  acknowledge_all();
  EXPECT_EQ(answer().data, way(PdoWait::none));
}

TEST_F(AcknowledgedDevices, AValueOnABusWithoutAcknowledgeWaitsForTheBus) {
  run();
  write_status(4);
  hand_out();
  pass(milliseconds(900));
  EXPECT_FALSE(is_answered());
  pass(milliseconds(200));
  EXPECT_EQ(answer().data, way(PdoWait::bus));
}

// Device 5 wins arbitration; the PDO of device 6 waits.
TEST_F(AcknowledgedDevices, APdoThatWaitsIsGoneWhenItsDeviceIsStoppedOrReset) {
  run();
  for (const std::uint8_t command : {std::uint8_t{0x80}, std::uint8_t{0x81}, std::uint8_t{0x82}}) {
    for (const std::uint8_t device : {std::uint8_t{5}, std::uint8_t{6}}) {
      line_->execute({.request = PdoTrigger{.node = device, .number = 1}}, now_);
    }
    can::Frame first;
    ASSERT_TRUE(line_->next_frame(first, now_));
    EXPECT_EQ(first.id, 0x185U);
    hear(0x000, {command, 0x06});
    EXPECT_THAT(hand_out(), testing::Each(testing::Not(testing::StartsWith("186#"))));
    hear(0x000, {0x01, 0x06});
    hand_out();
  }
}

// As above: the PDO carries the newest value, and is sent once.
TEST_F(AcknowledgedDevices, APdoThatWaitsTakesTheNewestValue) {
  run();
  const auto write = [this](std::uint8_t device, std::uint8_t value) {
    for (std::uint32_t entry = 0;
         const image::Entry& each : line_->layout(Direction::outputs).entries) {
      if (each.node == device) {
        line_->execute({.request = SingleOutput{.entry = entry,
                                                .data = std::vector<std::byte>(each.bit_length / 8,
                                                                               std::byte{value})}},
                       now_);
        return;
      }
      ++entry;
    }
  };
  write(6, 1);
  write(5, 1);
  can::Frame first;
  ASSERT_TRUE(line_->next_frame(first, now_));
  EXPECT_EQ(first.id, 0x185U);
  write(6, 2);
  EXPECT_THAT(hand_out(), ElementsAre("186#020200000000"));
}

TEST_F(AcknowledgedDevices, AValueOfADeviceThatIsNotOperationalWaitsForIt) {
  run();
  hear(0x000, {0x80, 0x05});
  write_status(4);
  EXPECT_EQ(answer().data, way(PdoWait::operational));
}

TEST_F(AcknowledgedDevices, AValueThatNoPdoCarriesIsWritten) {
  run();
  for (const std::uint32_t raw : {0x8000'0185U}) {
    EXPECT_TRUE(line_->dictionary().set({0x1800, 1}, raw));
  }
  write_status(4);
  EXPECT_EQ(answer().data, ReplyData{});
  EXPECT_THAT(hand_out(), IsEmpty());
}

TEST_F(AcknowledgedDevices, ATriggeredPdoIsAnsweredWhenItIsOnTheBus) {
  run();
  trigger();
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("185#000000000000"));
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  trigger();
  hand_out();
  pass(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

TEST_F(AcknowledgedDevices, AnEmcyIsAnsweredWhenItIsOnTheBus) {
  run();
  send_emcy(0x5000);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("086#0050010000000000"));
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  send_emcy(0x5100);
  hand_out();
  pass(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

TEST_F(AcknowledgedDevices, AnEmcyIsReportedAsSentWhenItIsOnTheBus) {
  run();
  send_emcy(0x5000);
  hand_out();
  EXPECT_FALSE(emitted(EventKind::emcy_sent, 6)) << "only the controller has the frame";
  acknowledge_all();
  EXPECT_TRUE(emitted(EventKind::emcy_sent, 6));
}

TEST_F(AcknowledgedDevices, WhatAResetDropsIsRefused) {
  run();
  trigger();
  hear(0x000, {0x82, 0x05});
  line_->advance(now_);
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
}

TEST_F(AcknowledgedDevices, AFrameOfNoServiceIsAnsweredWhenItIsOnTheBus) {
  run();
  line_->execute({.request = CanSend{.frame = can::make_frame(0x352, {1})}}, now_);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("352#01"));
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
}

TEST_F(AcknowledgedDevices, ThatWaitEndWithTheLine) {
  run();
  trigger();
  line_->stop(now_);
  EXPECT_EQ(answer().error, to_error(Refusal::cancelled));
}

}  // namespace
}  // namespace linegate::line
