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

}  // namespace
}  // namespace linegate::pdo
