// SPDX-License-Identifier: Apache-2.0
// The values that a device has transmitted, as its engine reports them.
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

// TPDO 1 sends 2002h (one byte) and 2003h (two bytes).
struct Followed : Listener {
  Followed() : device(device_description()) {
    device.engine->set_listener(this);
    device.engine->follow_transmission();
    device.engine->configure();
    device.operational();
    hand_out();
    device.engine->acknowledged(number);
    reported.clear();
  }
  static od::DeviceDescription device_description() {
    od::DeviceDescription out = plain_device();
    add_tpdo(out, {.cob_id = 0x181, .mapping = {0x20020008, 0x20030010}});
    return out;
  }
  void tpdo_transmitted(std::uint16_t tpdo, std::span<const std::byte> differs) override {
    EXPECT_EQ(tpdo, 1);
    std::vector<std::uint16_t> values;
    for (const Engine::SentObject& object : device.engine->sent_objects()) {
      if (!object.has_bit(differs)) {
        values.push_back(object.address.index);
      }
    }
    reported.push_back(std::move(values));
  }
  std::size_t hand_out() {
    can::Frame frame;
    std::size_t count = 0;
    for (; device.engine->next_frame(frame, at(0), number + 1); ++count) {
      ++number;
    }
    return count;
  }
  void set(std::uint16_t index, std::uint64_t value) {
    EXPECT_TRUE(device.dictionary.set({index, 0}, value));
    device.engine->value_changed({index, 0}, at(0));
  }

  Device device;
  std::uint64_t number = 0;
  std::vector<std::vector<std::uint16_t>> reported;  // the objects without a differing bit
};

TEST(Transmission, IsReportedWhenTheBusAcknowledgedTheFrame) {
  Followed of;
  of.set(0x2002, 7);
  EXPECT_EQ(of.hand_out(), 1U);
  EXPECT_THAT(of.reported, IsEmpty());
  of.device.engine->acknowledged(of.number);
  EXPECT_THAT(of.reported, ElementsAre(ElementsAre(0x2002, 0x2003)));
}

TEST(Transmission, ExcludesValuesThatChangedSince) {
  Followed of;
  of.set(0x2002, 7);
  of.hand_out();
  of.set(0x2003, 0x0100);
  of.device.engine->acknowledged(of.number);
  EXPECT_THAT(of.reported, ElementsAre(ElementsAre(0x2002)));
}

TEST(Transmission, OfFramesBeforeTheEndOfOperationalIsNotReported) {
  Followed of;
  of.set(0x2002, 7);
  of.hand_out();
  of.device.engine->set_operational(false, at(0));
  of.device.engine->set_operational(true, at(0));
  of.device.engine->acknowledged(of.number);
  EXPECT_THAT(of.reported, IsEmpty());
  EXPECT_EQ(of.hand_out(), 1U);
  of.device.engine->forget_transmission();
  of.device.engine->acknowledged(of.number);
  EXPECT_THAT(of.reported, IsEmpty());
}

TEST(Transmission, OfALostFrameIsRepeated) {
  Followed of;
  of.set(0x2002, 7);
  of.hand_out();
  of.device.engine->lost(of.number, of.number);
  EXPECT_EQ(of.hand_out(), 1U);
  of.device.engine->acknowledged(of.number);
  EXPECT_THAT(of.reported, ElementsAre(ElementsAre(0x2002, 0x2003)));
}

// TPDO 2 sends 2002h by MPDO in source address mode.
struct FollowedMpdos : Listener {
  FollowedMpdos() : device(device_description()) {
    device.engine->set_listener(this);
    device.engine->set_node_id(7);
    device.engine->follow_transmission();
    device.engine->configure();
    device.operational();
  }
  static od::DeviceDescription device_description() {
    od::DeviceDescription out = plain_device();
    add_tpdo(out, {.number = 2, .cob_id = 0x281, .mapping = {}});
    out.objects.back().variables[0].value = {std::byte{0xFE}};
    out.objects.push_back({.index = 0x1FA0, .name = "Scanner list"});
    out.objects.back().variables = {variable(0, DataType::unsigned8, Access::constant, 1),
                                    variable(1, DataType::unsigned32, Access::rw, 0x01'2002'00)};
    return out;
  }
  void mpdo_transmitted(od::Address source) override { reported.push_back(source.index); }
  void set(std::uint8_t value) {
    EXPECT_TRUE(device.dictionary.set({0x2002, 0}, std::uint64_t{value}));
    device.engine->value_changed({0x2002, 0}, at(0));
  }
  std::size_t hand_out() {
    can::Frame frame;
    std::size_t count = 0;
    for (; device.engine->next_frame(frame, at(0), number + 1); ++count) {
      ++number;
    }
    return count;
  }
  std::vector<std::uint16_t> acknowledge() {
    device.engine->acknowledged(number);
    return std::exchange(reported, {});
  }

  Device device;
  std::uint64_t number = 0;
  std::vector<std::uint16_t> reported;
};

TEST(TransmissionByMpdo, IsReportedWhenTheBusAcknowledgedTheNewestValue) {
  FollowedMpdos of;
  EXPECT_TRUE(of.device.engine->scans({0x2002, 0}));
  EXPECT_FALSE(of.device.engine->scans({0x2003, 0}));
  EXPECT_EQ(of.device.engine->scanning_tpdo(), 2);
  EXPECT_TRUE(of.device.engine->awaits_trigger(od::Address{0x2002, 0}));
  of.set(7);
  EXPECT_FALSE(of.device.engine->awaits_trigger(od::Address{0x2002, 0}));
  EXPECT_EQ(of.hand_out(), 1U);
  EXPECT_FALSE(of.device.engine->awaits_trigger(od::Address{0x2002, 0}));
  of.set(8);
  EXPECT_THAT(of.acknowledge(), IsEmpty()) << "value 7";
  EXPECT_EQ(of.hand_out(), 1U);
  EXPECT_THAT(of.acknowledge(), ElementsAre(0x2002));
  EXPECT_THAT(of.acknowledge(), IsEmpty());
}

TEST(TransmissionByMpdo, OfARepeatedValueIsReportedWithItsFirstFrame) {
  FollowedMpdos of;
  of.set(7);
  of.hand_out();
  of.set(7);
  EXPECT_EQ(of.hand_out(), 1U);
  of.device.engine->acknowledged(1);
  EXPECT_THAT(of.reported, ElementsAre(0x2002));
}

TEST(TransmissionByMpdo, OfADroppedObjectIsNeitherReportedNorRepeated) {
  FollowedMpdos of;
  of.set(7);
  of.hand_out();
  const od::Address dropped{0x2002, 0};
  of.device.engine->drop_mpdos({&dropped, 1});
  of.device.engine->lost(of.number, of.number);
  EXPECT_EQ(of.hand_out(), 0U);
  EXPECT_THAT(of.acknowledge(), IsEmpty());
}

TEST(TransmissionByMpdo, IsReportedAtOnceWhereTheBusReportsNothing) {
  FollowedMpdos of;
  of.set(7);
  can::Frame frame;
  EXPECT_TRUE(of.device.engine->next_frame(frame, at(0)));
  EXPECT_THAT(of.reported, ElementsAre(0x2002));
}

TEST(TransmissionByMpdo, OfALostFrameIsRepeatedWithThePresentValue) {
  FollowedMpdos of;
  of.set(7);
  of.hand_out();
  EXPECT_TRUE(of.device.dictionary.set({0x2002, 0}, std::uint64_t{9}));
  of.device.engine->lost(of.number, of.number);
  EXPECT_THAT(of.acknowledge(), IsEmpty());
  EXPECT_EQ(of.hand_out(), 1U);
  EXPECT_THAT(of.acknowledge(), ElementsAre(0x2002));
}

TEST(TransmissionByMpdo, OfFramesBeforeTheEndOfOperationalIsNotReported) {
  FollowedMpdos of;
  of.set(7);
  of.hand_out();
  of.device.engine->set_operational(false, at(0));
  of.device.engine->set_operational(true, at(0));
  EXPECT_THAT(of.acknowledge(), IsEmpty());
}

}  // namespace
}  // namespace linegate::pdo
