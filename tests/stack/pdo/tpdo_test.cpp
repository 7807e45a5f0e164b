// SPDX-License-Identifier: Apache-2.0
// TPDOs of a device: when they are sampled and when they are sent.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

using Pdos = std::vector<Pdo>;

od::DeviceDescription with(const Pdos& pdos) {
  od::DeviceDescription out = plain_device();
  for (const Pdo& pdo : pdos) {
    add_tpdo(out, pdo);
  }
  return out;
}

// A device in Operational, after it has sent its initial frames.
struct Transmitting : Device {
  explicit Transmitting(const Pdos& pdos) : Device(with(pdos)) {
    EXPECT_THAT(diagnostics, IsEmpty());
    operational();
    (void)sent(at(0));
  }
  void set(std::uint16_t index, std::uint64_t value, Instant now) {
    EXPECT_TRUE(dictionary.set({index, 0}, value));
    engine->value_changed({index, 0}, now);
  }
};

can::Frame rtr(std::uint32_t id) {
  can::Frame out;
  out.id = id;
  out.flags = can::Frame::kRemote;
  return out;
}

TEST(Tpdo, EveryLengthAndBooleansAreSent) {
  Device device(
      with({{.cob_id = 0x181, .mapping = {0x20000001, 0x20010001, 0x20040018, 0x20030010}}}));
  device.dictionary.set({0x2001, 0}, 1);
  device.dictionary.set({0x2004, 0}, 0x030201);
  device.dictionary.set({0x2003, 0}, 0x0504);
  device.operational();
  const std::vector<can::Frame> sent = device.sent(at(0));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].id, 0x181U);
  // Two bits, then 030201h and 0504h, shifted by two bits.
  EXPECT_THAT(data_of(sent[0]), ElementsAre(0x06, 0x08, 0x0C, 0x10, 0x14, 0x00));
}

TEST(Tpdo, NothingBeforeOperationalAndEverythingOnceAtItsBeginning) {
  Device device(with({{.cob_id = 0x181, .mapping = {0x20030010}},
                      {.number = 2, .cob_id = 0x80000281, .mapping = {0x20030010}},
                      {.number = 3, .cob_id = 0x381, .type = 0, .mapping = {0x20030010}},
                      {.number = 4, .cob_id = 0x481, .type = 1, .mapping = {0x20030010}}}));
  device.engine->value_changed({0x2003, 0}, at(0));
  EXPECT_FALSE(device.engine->trigger(1, at(0)));
  EXPECT_THAT(device.sent_ids(at(0)), IsEmpty());
  device.operational(at(1));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x181));
  device.engine->sync(0, at(2));
  EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x381, 0x481));
  device.engine->set_operational(false, at(3));
  device.engine->value_changed({0x2003, 0}, at(4));
  EXPECT_THAT(device.sent_ids(at(4)), IsEmpty());
}

TEST(Tpdo, AChangedValueIsSentAndAnUnchangedOneIsNot) {
  Transmitting device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}}});
  device.set(0x2003, 7, at(1));
  EXPECT_TRUE(device.engine->wants_to_send(at(1)));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(7, 0));
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  device.set(0x2003, 7, at(2));
  EXPECT_THAT(device.sent_ids(at(2)), IsEmpty());
  EXPECT_TRUE(device.engine->trigger(1, at(3)));
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x181));
  EXPECT_EQ(device.engine->counters().sent, 3U);
}

TEST(Tpdo, TriggerKnowsWhatExists) {
  Transmitting device(Pdos{{.number = 2, .cob_id = 0x281, .mapping = {0x20030010}}});
  EXPECT_FALSE(device.engine->trigger(0, at(1)));
  EXPECT_FALSE(device.engine->trigger(1, at(1)));
  EXPECT_TRUE(device.engine->trigger(2, at(1)));
  EXPECT_FALSE(device.engine->trigger(3, at(1)));
}

TEST(Tpdo, OneObjectInSeveralTpdosRequestsThemAll) {
  Transmitting device(Pdos{{.cob_id = 0x481, .mapping = {0x20030010}},
                           {.number = 2, .cob_id = 0x281, .mapping = {0x20020008, 0x20030010}},
                           {.number = 3, .cob_id = 0x381, .mapping = {0x20020008}}});
  device.set(0x2003, 7, at(1));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281, 0x481));
}

TEST(Tpdo, TheLowestIdentifierGoesFirst) {
  std::vector<Pdo> pdos;
  for (std::uint16_t n = 1; n <= 100; ++n) {
    pdos.push_back({.number = n, .cob_id = 0x400U - n, .mapping = {0x20030010}});
  }
  pdos.push_back({.number = 101, .cob_id = 0x2000'0001, .mapping = {0x20030010}});
  Transmitting device(pdos);
  device.set(0x2003, 1, at(1));
  std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 101U);
  for (std::size_t i = 1; i < sent.size(); ++i) {
    EXPECT_TRUE(can::wins_arbitration(sent[i - 1], sent[i])) << i;
  }
}

TEST(Tpdo, TheNewestSampleIsSentAndTheOthersAreCounted) {
  Transmitting device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}}});
  device.set(0x2003, 1, at(1));
  device.set(0x2003, 2, at(1));
  device.set(0x2003, 2, at(1));
  device.set(0x2003, 3, at(1));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(3, 0));
  EXPECT_EQ(device.engine->counters().coalesced, 2U);
}

TEST(Tpdo, InhibitTimeSeparatesThem) {
  Transmitting device(Pdos{{.cob_id = 0x181, .inhibit = 100, .mapping = {0x20030010}},
                           {.number = 2, .cob_id = 0x281, .mapping = {0x20020008}}});
  device.set(0x2003, 1, at(5));
  EXPECT_FALSE(device.engine->wants_to_send(at(5)));
  EXPECT_THAT(device.sent_ids(at(5)), IsEmpty());
  EXPECT_EQ(device.engine->next_wake(), at(10));
  device.set(0x2002, 1, at(6));
  EXPECT_THAT(device.sent_ids(at(6)), ElementsAre(0x281)) << "the other TPDO is not delayed";
  device.set(0x2003, 2, at(7));
  EXPECT_TRUE(device.engine->wants_to_send(at(10)));
  const std::vector<can::Frame> sent = device.sent(at(10));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(2, 0));
  EXPECT_EQ(device.engine->next_wake(), kNever) << "nothing is requested";
}

TEST(Tpdo, EventTimerSendsWhenNothingElseDid) {
  Transmitting device(Pdos{{.cob_id = 0x181, .event_timer = 100, .mapping = {0x20030010}}});
  EXPECT_EQ(device.engine->next_wake(), at(100));
  device.set(0x2003, 1, at(60));
  EXPECT_EQ(device.sent(at(60)).size(), 1U);
  device.engine->advance(at(100));
  EXPECT_THAT(device.sent_ids(at(100)), IsEmpty());
  EXPECT_EQ(device.engine->next_wake(), at(160));
  device.engine->advance(at(160));
  EXPECT_THAT(device.sent_ids(at(160)), ElementsAre(0x181));
  device.engine->advance(at(260));
  EXPECT_THAT(device.sent_ids(at(260)), ElementsAre(0x181));
}

TEST(Tpdo, Type0IsSentAtTheSyncAfterAnEvent) {
  Transmitting device(Pdos{{.cob_id = 0x181, .type = 0, .mapping = {0x20030010}}});
  device.engine->sync(0, at(1));
  (void)device.sent(at(1));
  device.engine->sync(0, at(2));
  EXPECT_THAT(device.sent_ids(at(2)), IsEmpty());
  device.set(0x2003, 1, at(3));
  EXPECT_THAT(device.sent_ids(at(3)), IsEmpty());
  device.dictionary.set({0x2003, 0}, 9);
  device.engine->sync(0, at(4));
  const std::vector<can::Frame> sent = device.sent(at(4));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(9, 0)) << "sampled at the SYNC";
  device.engine->sync(0, at(5));
  EXPECT_THAT(device.sent_ids(at(5)), IsEmpty());
}

class Cyclic : public testing::TestWithParam<std::uint8_t> {};

TEST_P(Cyclic, IsSentWithEveryNthSync) {
  const std::uint8_t n = GetParam();
  Transmitting device(Pdos{{.cob_id = 0x181, .type = n, .mapping = {0x20030010}}});
  for (int sync = 1; sync <= 3 * n; ++sync) {
    device.engine->sync(0, at(sync));
    EXPECT_EQ(device.sent(at(sync)).size(), sync % n == 0 ? 1U : 0U) << sync;
  }
}

INSTANTIATE_TEST_SUITE_P(Types, Cyclic, testing::Values(1, 2, 7, 240));

TEST(Tpdo, SyncStartValueBeginsTheCount) {
  Transmitting device(Pdos{{.cob_id = 0x181, .type = 2, .sync_start = 3, .mapping = {0x20030010}}});
  std::vector<int> sent_at;
  for (int sync = 1; sync <= 8; ++sync) {
    device.engine->sync(static_cast<std::uint8_t>(sync), at(sync));
    if (!device.sent(at(sync)).empty()) {
      sent_at.push_back(sync);
    }
  }
  EXPECT_THAT(sent_at, ElementsAre(4, 6, 8));
}

TEST(Tpdo, WithoutASyncCounterTheStartValueMeansNothing) {
  Transmitting device(Pdos{{.cob_id = 0x181, .type = 1, .sync_start = 3, .mapping = {0x20030010}}});
  device.engine->sync(0, at(1));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x181));
}

TEST(Tpdo, Type253IsSampledAndSentOnRequest) {
  Transmitting device(Pdos{{.cob_id = 0x181, .type = 253, .mapping = {0x20030010}}});
  device.set(0x2003, 5, at(1));
  device.engine->sync(0, at(1));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  device.receive(rtr(0x181));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(5, 0));
}

TEST(Tpdo, Type252IsSampledAtSyncAndSentOnRequest) {
  Transmitting device(Pdos{{.cob_id = 0x181, .type = 252, .mapping = {0x20030010}}});
  device.set(0x2003, 5, at(1));
  device.engine->sync(0, at(1));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  device.set(0x2003, 6, at(2));
  device.receive(rtr(0x181));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(5, 0));
}

TEST(Tpdo, RemoteFramesOnlyWhereTheyAreAllowed) {
  Transmitting device(Pdos{{.cob_id = 0x4000'0181, .mapping = {0x20030010}},
                           {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}}});
  device.receive(rtr(0x181));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  device.receive(rtr(0x281));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281));
}

TEST(Tpdo, TheListenerMayRefreshValuesBeforeTheyAreSampled) {
  struct Refresh : Listener {
    explicit Refresh(Device& d) : device(d) {}
    void before_tpdo(std::uint16_t number) override {
      device.dictionary.set({0x2003, 0}, 40 + number);
    }
    Device& device;
  };
  Transmitting device(Pdos{{.number = 2, .cob_id = 0x281, .type = 1, .mapping = {0x20030010}}});
  Refresh refresh(device);
  device.engine->set_listener(&refresh);
  device.engine->sync(0, at(1));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(42, 0));
}

TEST(Tpdo, CanFdFramesAreFilledUp) {
  Device device(with({{.cob_id = 0x181, .mapping = {0x20060040, 0x20030010}}}));
  device.engine->set_max_length(64);
  EXPECT_THAT(device.engine->configure(), IsEmpty());
  device.dictionary.set({0x2003, 0}, 0x0102);
  device.operational();
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_TRUE(sent[0].fd());
  EXPECT_THAT(data_of(sent[0]), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0, 2, 1, 0, 0));
}

TEST(Tpdo, ShortOnesOfAnFdLineAreFdFramesToo) {
  Device device(with({{.cob_id = 0x181, .mapping = {0x20030010}}}));
  device.engine->set_max_length(64);
  EXPECT_THAT(device.engine->configure(), IsEmpty());
  device.operational();
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].flags, can::Frame::kFd | can::Frame::kBitRateSwitch);
  EXPECT_EQ(sent[0].length, 2);
}

// Remapping one TPDO must not discard the request of another one.
TEST(Tpdo, RequestsOutliveTheRemappingOfOthers) {
  Transmitting device(Pdos{{.cob_id = 0x481, .mapping = {0x20030010}},
                           {.number = 2, .cob_id = 0x281, .mapping = {0x20020008}}});
  device.set(0x2003, 1, at(1));
  EXPECT_EQ(device.write(0x1801, 1, 0x8000'0281), AbortCode::none);
  EXPECT_EQ(device.write(0x1801, 1, 0x581 - 0x100), AbortCode::none);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x481, 0x481));
}

}  // namespace
}  // namespace linegate::pdo
