// SPDX-License-Identifier: Apache-2.0
// Multiplexed PDOs, both modes, both roles: CiA 301, 7.2.2.6.
#include "stack/pdo/mpdo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint8_t kNode = 5;

struct Told {
  std::uint16_t number;
  od::Address place;
  AbortCode why;
  bool operator==(const Told&) const = default;
};
struct MpdoListener : Listener {
  void mpdo_received(std::uint16_t number, od::Address place, Instant) override {
    received.push_back({number, place, AbortCode::none});
  }
  void mpdo_refused(std::uint16_t number, MpdoMode, od::Address place, AbortCode why) override {
    refused.push_back({number, place, why});
  }
  void mpdo_malformed(const can::Frame&) override { ++malformed; }
  void rpdo_deadline(std::uint16_t number) override { deadlines.push_back(number); }
  void rpdo_in_order(std::uint16_t number) override { in_order.push_back(number); }

  std::vector<Told> received;
  std::vector<Told> refused;
  std::vector<std::uint16_t> deadlines;
  std::vector<std::uint16_t> in_order;
  unsigned malformed = 0;
};

od::ObjectDescription list(std::uint16_t index, DataType type,
                           const std::vector<std::uint64_t>& entries) {
  od::ObjectDescription out;
  out.index = index;
  out.type = od::ObjectType::array;
  out.variables = {variable(0, DataType::unsigned8, Access::rw, entries.size())};
  for (std::size_t i = 0; i < entries.size(); ++i) {
    out.variables.push_back(
        variable(static_cast<std::uint8_t>(i + 1), type, Access::rw, entries[i]));
  }
  return out;
}

// 2100h: three U16, rw. RPDO 1 (201h) is an MPDO in destination address mode, RPDO 2 (301h) in
// source address mode, as TPDO 1 (181h) and TPDO 2 (281h); TPDO 1 sends 2003h.
od::DeviceDescription description() {
  od::DeviceDescription out = plain_device();
  od::ObjectDescription values = list(0x2100, DataType::unsigned16, {0, 0, 0});
  for (od::VariableDescription& value : values.variables) {
    value.mappable = value.sub != 0;
  }
  out.objects.push_back(values);
  const auto multiplexed = [](Pdo pdo, std::uint64_t mode, std::uint16_t base) {
    od::DeviceDescription made;
    add_pdo(made, base, pdo);
    made.objects[1].variables[0].value = {static_cast<std::byte>(mode)};
    return made.objects;
  };
  for (const auto& objects :
       {multiplexed({.cob_id = 0x201, .event_timer = 100}, 255, 0x1400),
        multiplexed({.number = 2, .cob_id = 0x301}, 254, 0x1400),
        multiplexed({.cob_id = 0x181, .inhibit = 100, .mapping = {0x20030010}}, 255, 0x1800),
        multiplexed({.number = 2, .cob_id = 0x281}, 254, 0x1800)}) {
    out.objects.insert(out.objects.end(), objects.begin(), objects.end());
  }
  // The scanner list has 2100h:2 and 3 and 2002h. The dispatcher list writes 3000h:1 and 2 of node
  // 9 to 2100h:1 and 2, and its 3001h:0 to 2002h and to 2010h, which is read-only.
  out.objects.push_back(list(0x1FA0, DataType::unsigned32, {0x02'2100'02}));
  out.objects.push_back(list(0x1FA1, DataType::unsigned32, {0, 0x00'2002'00}));
  out.objects.push_back(
      list(0x1FD0, DataType::unsigned64, {0x02'2100'01'3000'01'09, 0x01'2002'00'3001'00'09}));
  out.objects.push_back(list(0x1FFF, DataType::unsigned64, {0x00'2010'00'3001'00'09}));
  return out;
}

struct MpdoTest : testing::Test {
  MpdoTest() : device(description()) {
    device.engine->set_node_id(kNode);
    device.engine->set_listener(&listener);
    EXPECT_THAT(device.diagnostics, IsEmpty());
    device.operational();
    EXPECT_THAT(device.sent_ids(at(0)), IsEmpty()) << "MPDOs have no event";
  }
  EngineCounters counters() { return device.engine->counters(); }

  Device device;
  MpdoListener listener;
};

TEST(Mpdo, FrameLayout) {
  const Mpdo mpdo{MpdoMode::destination,
                  7,
                  {0x6200, 3},
                  {std::byte{0x11}, std::byte{0x22}, std::byte{0x33}, std::byte{0x44}}};
  const MpdoData data = encode(mpdo);
  const can::Frame made = can::make_frame(0x201, data);
  EXPECT_THAT(data_of(made), ElementsAre(0x87, 0x00, 0x62, 0x03, 0x11, 0x22, 0x33, 0x44));
  const auto read = decode_mpdo(made);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->mode, MpdoMode::destination);
  EXPECT_EQ(read->node, 7);
  EXPECT_EQ(read->address, (od::Address{0x6200, 3}));
  EXPECT_EQ(read->value, mpdo.value);
  EXPECT_EQ(decode_mpdo(frame(1, {0x07, 0, 0x62, 3, 1, 2, 3, 4}, at(0)))->mode, MpdoMode::source);
  EXPECT_TRUE(decode_mpdo(frame(1, {0x80, 0, 0x62, 3, 1, 2, 3, 4}, at(0)))) << "to all nodes";
  EXPECT_FALSE(decode_mpdo(frame(1, {0x00, 0, 0x62, 3, 1, 2, 3, 4}, at(0)))) << "from node 0";
  EXPECT_FALSE(decode_mpdo(frame(1, {0x80, 0, 0x62, 3, 1, 2, 3}, at(0))));
}

TEST(Mpdo, EntriesOfTheLists) {
  const MpdoBlock scanned = ScannerList::entry(0x03'6200'10);
  EXPECT_EQ(scanned.first, (od::Address{0x6200, 0x10}));
  EXPECT_FALSE(scanned.contains({0x6200, 0x0F}));
  EXPECT_TRUE(scanned.contains({0x6200, 0x12}));
  EXPECT_FALSE(scanned.contains({0x6200, 0x13}));
  EXPECT_FALSE(scanned.contains({0x6201, 0x10}));
  const DispatcherList::Entry entry = DispatcherList::entry(0x04'2100'01'6000'02'7F);
  EXPECT_EQ(entry.node, 0x7F);
  EXPECT_EQ(entry.remote.first, (od::Address{0x6000, 2}));
  EXPECT_EQ(entry.remote.count, 4);
  EXPECT_EQ(entry.local, (od::Address{0x2100, 1}));
}

TEST_F(MpdoTest, DestinationAddressModeWritesWhatTheFrameNames) {  // 8230h
  device.receive(frame(0x201, {0x80 | kNode, 0x00, 0x21, 2, 0x34, 0x12, 0xFF, 0xFF}, at(1)));
  EXPECT_EQ(device.read(0x2100, 2), 0x1234U) << "only the bytes of the object";
  device.receive(frame(0x201, {0x80, 0x05, 0x20, 0, 1, 2, 3, 4}, at(2)));
  EXPECT_EQ(device.read(0x2005), 0x04030201U) << "to all nodes";
  device.receive(frame(0x201, {0x80 | 6, 0x05, 0x20, 0, 9, 9, 9, 9}, at(3)));
  EXPECT_EQ(device.read(0x2005), 0x04030201U) << "to another node";
  EXPECT_THAT(listener.received, ElementsAre(Told{1, {0x2100, 2}, AbortCode::none},
                                             Told{1, {0x2005, 0}, AbortCode::none}));
  EXPECT_EQ(counters().mpdos_received, 2U);
  EXPECT_EQ(counters().mpdos_refused, 0U);
}

TEST_F(MpdoTest, WhatIsNotThereOrNotForRpdosIsRefused) {
  const std::pair<od::Address, AbortCode> rows[] = {
      {{0x3000, 0}, AbortCode::no_object},    {{0x2100, 4}, AbortCode::no_sub_index},
      {{0x2100, 0}, AbortCode::not_mappable}, {{0x2010, 0}, AbortCode::not_mappable},
      {{0x2012, 0}, AbortCode::not_mappable}, {{0x2006, 0}, AbortCode::not_mappable},
      {{0x1400, 1}, AbortCode::not_mappable},
  };
  for (const auto& [place, why] : rows) {
    listener.refused.clear();
    device.receive(frame(0x201,
                         {0x80, static_cast<std::uint8_t>(place.index),
                          static_cast<std::uint8_t>(place.index >> 8), place.sub, 1, 2, 3, 4},
                         at(1)));
    EXPECT_THAT(listener.refused, ElementsAre(Told{1, place, why}));
  }
  EXPECT_EQ(counters().mpdos_refused, std::size(rows));
  EXPECT_EQ(device.write(0x1400, 1, kInvalid | 0x201), AbortCode::none);
  EXPECT_THAT(listener.in_order, ElementsAre(1)) << "an invalid PDO has no error";
}

TEST_F(MpdoTest, SourceAddressModeGoesByTheDispatcherList) {
  device.receive(frame(0x301, {9, 0x00, 0x30, 2, 0x34, 0x12, 0, 0}, at(1)));
  EXPECT_EQ(device.read(0x2100, 1), 0U);
  EXPECT_EQ(device.read(0x2100, 2), 0x1234U) << "the second of the block";
  device.receive(frame(0x301, {9, 0x00, 0x30, 3, 1, 1, 1, 1}, at(1)));
  EXPECT_EQ(device.read(0x2100, 3), 0U) << "beyond the block";
  device.receive(frame(0x301, {8, 0x00, 0x30, 1, 1, 1, 1, 1}, at(1)));
  EXPECT_EQ(device.read(0x2100, 1), 0U) << "from another node";
  EXPECT_THAT(listener.refused, IsEmpty());
  device.receive(frame(0x301, {9, 0x01, 0x30, 0, 7, 0, 0, 0}, at(2)));
  EXPECT_EQ(device.read(0x2002), 7U);
  EXPECT_EQ(device.read(0x2010), 0U);
  EXPECT_THAT(listener.refused, ElementsAre(Told{2, {0x2010, 0}, AbortCode::not_mappable}))
      << "the second entry of the list";
}

TEST_F(MpdoTest, AWriteToTheDispatcherListTakesEffect) {
  EXPECT_EQ(device.write(0x1FD0, 2, 0x01'2003'00'3001'00'0A), AbortCode::none);
  device.receive(frame(0x301, {9, 0x01, 0x30, 0, 7, 0, 0, 0}, at(1)));
  EXPECT_EQ(device.read(0x2002), 0U);
  device.receive(frame(0x301, {10, 0x01, 0x30, 0, 7, 0, 0, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 7U);
}

TEST_F(MpdoTest, MalformedOnesAreCountedAndHarmless) {
  device.receive(frame(0x201, {0x80, 0x02, 0x20, 0, 1, 2, 3}, at(1)));
  device.receive(frame(0x201, {}, at(1)));
  device.receive(frame(0x201, {kNode, 0x02, 0x20, 0, 1, 2, 3, 4}, at(1)));
  device.receive(frame(0x301, {0x80, 0x01, 0x30, 0, 1, 2, 3, 4}, at(1)));
  device.receive(frame(0x301, {0x00, 0x01, 0x30, 0, 1, 2, 3, 4}, at(1)));
  EXPECT_EQ(listener.malformed, 5U);
  EXPECT_EQ(counters().mpdos_malformed, 5U);
  EXPECT_EQ(counters().received, 0U);
  EXPECT_EQ(device.read(0x2002), 0U);
  Random random(1);
  for (int i = 0; i < 20'000; ++i) {
    can::Frame noise;
    noise.id = i % 2 == 0 ? 0x201 : 0x301;
    noise.length = static_cast<std::uint8_t>(random() % 9);
    random.fill(noise.data);
    noise.time = at(2);
    device.receive(noise);
  }
}

TEST_F(MpdoTest, DeadlineOfTheRpdo) {
  device.receive(frame(0x201, {0x80, 0x02, 0x20, 0, 1, 0, 0, 0}, at(1)));
  device.engine->advance(at(100));
  EXPECT_THAT(listener.deadlines, IsEmpty());
  device.engine->advance(at(101));
  EXPECT_THAT(listener.deadlines, ElementsAre(1));
}

TEST_F(MpdoTest, SendsToAnObjectOfAnotherNode) {
  ASSERT_TRUE(device.dictionary.set({0x2003, 0}, 0x1234));
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 1}), AbortCode::none);
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].id, 0x181U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(0x89, 0x00, 0x62, 1, 0x34, 0x12, 0, 0));
  EXPECT_EQ(device.engine->send_mpdo(2, 9, {0x6200, 1}), AbortCode::no_object) << "source mode";
  EXPECT_EQ(device.engine->send_mpdo(3, 9, {0x6200, 1}), AbortCode::no_object);
  EXPECT_EQ(device.engine->send_mpdo(1, 128, {0x6200, 1}), AbortCode::invalid_value);
  device.engine->set_operational(false, at(2));
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 1}), AbortCode::device_state);
}

TEST_F(MpdoTest, WaitsForTheInhibitTimeInTurn) {
  const auto send = [this](std::uint8_t sub, unsigned value) {
    ASSERT_TRUE(device.dictionary.set({0x2003, 0}, value));
    EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, sub}), AbortCode::none);
  };
  send(1, 0x11);
  send(2, 0x22);
  send(1, 0x33);
  const std::vector<can::Frame> first = device.sent(at(1));
  ASSERT_EQ(first.size(), 1U);
  EXPECT_THAT(data_of(first[0]), ElementsAre(0x89, 0, 0x62, 1, 0x33, 0, 0, 0)) << "newest value";
  EXPECT_EQ(counters().coalesced, 1U);
  EXPECT_EQ(device.engine->next_wake(), at(11));
  const std::vector<can::Frame> second = device.sent(at(11));
  ASSERT_EQ(second.size(), 1U);
  EXPECT_THAT(data_of(second[0]), ElementsAre(0x89, 0, 0x62, 2, 0x22, 0, 0, 0));
  EXPECT_THAT(device.sent_ids(at(21)), IsEmpty());
  for (unsigned sub = 0; sub < Engine::kMpdosWaiting; ++sub) {
    send(static_cast<std::uint8_t>(sub), sub);
  }
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6201, 0}), AbortCode::out_of_memory);
}

TEST_F(MpdoTest, WhatWaitsIsDropped) {
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 1}), AbortCode::none);
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 2}), AbortCode::none);
  device.engine->value_changed({0x2100, 3}, at(1));
  EXPECT_EQ(device.engine->send_mpdo({0x2002, 0}), AbortCode::none);
  const od::Address dropped[] = {{0x2002, 0}};
  device.engine->drop_mpdos(dropped);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281)) << "2100h:3";
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 1}), AbortCode::none);
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 2}), AbortCode::none);
  EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x181));
  device.engine->drop_mpdos({});
  EXPECT_THAT(device.sent_ids(at(50)), IsEmpty()) << "it waited for the inhibit time";
  EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, 1}), AbortCode::none);
  EXPECT_THAT(device.sent_ids(at(60)), ElementsAre(0x181));
}

TEST_F(MpdoTest, AChangedObjectOfTheScannerListIsSent) {
  ASSERT_TRUE(device.dictionary.set({0x2100, 3}, 0x1234));
  device.engine->value_changed({0x2100, 3}, at(1));
  device.engine->value_changed({0x2100, 1}, at(1));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U) << "2100h:1 is not listed";
  EXPECT_EQ(sent[0].id, 0x281U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(kNode, 0x00, 0x21, 3, 0x34, 0x12, 0, 0));
  EXPECT_EQ(device.engine->send_mpdo({0x2002, 0}), AbortCode::none);
  EXPECT_EQ(device.engine->send_mpdo({0x2003, 0}), AbortCode::no_object);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281));
  EXPECT_EQ(device.write(0x1FA1, 1, 0x00'2003'00), AbortCode::none);
  EXPECT_EQ(device.engine->send_mpdo({0x2003, 0}), AbortCode::none);
}

TEST_F(MpdoTest, NoChangeOfAScannedObjectIsLost) {
  constexpr std::uint8_t kObjects = 2 * Engine::kMpdosWaiting;
  od::DeviceDescription many = description();
  many.objects.push_back(list(0x2200, DataType::unsigned16, std::vector<std::uint64_t>(kObjects)));
  for (od::VariableDescription& value : many.objects.back().variables) {
    value.mappable = value.sub != 0;
  }
  *std::ranges::find(many.objects, 0x1FA0, &od::ObjectDescription::index) =
      list(0x1FA0, DataType::unsigned32, {std::uint64_t{kObjects} << 24U | 0x2200'01});
  Device other(many);
  other.engine->set_node_id(kNode);
  other.operational();
  other.engine->set_auto_notify(2, true);
  for (std::uint8_t sub = 1; sub <= kObjects; ++sub) {
    EXPECT_EQ(other.write(0x2200, sub, sub), AbortCode::none);
  }
  EXPECT_EQ(other.sent(at(1)).size(), kObjects);
}

TEST_F(MpdoTest, WithAutoNotifyTheScannerListIsSentByItself) {
  const auto set = [this](std::uint8_t sub, unsigned value) {
    ASSERT_TRUE(device.dictionary.set({0x2100, sub}, value));
  };
  set(3, 0x11);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  device.engine->set_auto_notify(2, true);
  set(1, 0x22);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty()) << "not in the scanner list";
  set(3, 0x11);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty()) << "the value did not change";
  EXPECT_EQ(device.write(0x2100, 3, 0x1234), AbortCode::none);
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(kNode, 0x00, 0x21, 3, 0x34, 0x12, 0, 0));
  device.receive(frame(0x201, {0x80 | kNode, 0x00, 0x21, 2, 7, 0, 0, 0}, at(2)));
  EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x281)) << "written by an MPDO";
  EXPECT_EQ(device.write(0x1FA1, 1, 0x00'2003'00), AbortCode::none);
  ASSERT_TRUE(device.dictionary.set({0x2003, 0}, 9));
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x281)) << "uses the present list";
}

// TPDO 1 (inhibit time 10 ms) to other nodes, TPDO 2 from the scanner list.
TEST_F(MpdoTest, WaitsForTheEndOfAGroupOfWrites) {
  const auto send = [this](std::uint8_t sub, unsigned value) {
    ASSERT_TRUE(device.dictionary.set({0x2003, 0}, value));
    EXPECT_EQ(device.engine->send_mpdo(1, 9, {0x6200, sub}), AbortCode::none);
  };
  const auto first_bytes = [this](Instant now) {
    std::vector<std::vector<unsigned>> out;
    for (const can::Frame& sent : device.sent(now)) {
      std::vector<unsigned> data = data_of(sent);
      data.resize(5);
      out.push_back(data);
    }
    return out;
  };
  send(1, 0x11);
  device.engine->hold();
  EXPECT_THAT(first_bytes(at(1)), ElementsAre(ElementsAre(0x89, 0, 0x62, 1, 0x11)))
      << "requested before hold()";
  send(1, 0x12);
  send(2, 0x22);
  send(1, 0x13);
  ASSERT_TRUE(device.dictionary.set({0x2100, 3}, 0x33));
  device.engine->value_changed({0x2100, 3}, at(2));
  ASSERT_TRUE(device.dictionary.set({0x2100, 3}, 0x34));
  EXPECT_EQ(device.engine->send_mpdo({0x2100, 3}), AbortCode::none);
  EXPECT_FALSE(device.engine->wants_to_send(at(20)));
  EXPECT_THAT(device.sent_ids(at(20)), IsEmpty());
  device.engine->release(at(20));
  EXPECT_THAT(first_bytes(at(20)), ElementsAre(ElementsAre(0x89, 0, 0x62, 1, 0x13),
                                               ElementsAre(kNode, 0x00, 0x21, 3, 0x34)))
      << "the newest value of each object";
  EXPECT_THAT(first_bytes(at(30)), ElementsAre(ElementsAre(0x89, 0, 0x62, 2, 0x22)));
  device.engine->release(at(40));
  EXPECT_THAT(device.sent_ids(at(40)), IsEmpty());
}

// A value that waits for the inhibit time before the group is not mixed with it: it is replaced by
// the value of the group only when the whole group may be sent.
TEST_F(MpdoTest, AGroupOfWritesReplacesWhatWaitsWhenItEnds) {
  const auto send = [this](std::uint8_t sub, unsigned value) {
    EXPECT_TRUE(device.dictionary.set({0x2003, 0}, value));
    return device.engine->send_mpdo(1, 9, {0x6200, sub});
  };
  const auto value_at = [this](std::int64_t ms) {
    const std::vector<can::Frame> sent = device.sent(at(ms));
    return sent.size() == 1 ? data_of(sent[0])[4] : 0U;
  };
  EXPECT_EQ(send(1, 0x11), AbortCode::none);
  EXPECT_EQ(send(2, 0x22), AbortCode::none);
  EXPECT_EQ(send(3, 0x33), AbortCode::none);
  EXPECT_EQ(value_at(1), 0x11U);
  device.engine->hold();
  EXPECT_EQ(send(2, 0x44), AbortCode::none);
  EXPECT_EQ(send(3, 0x55), AbortCode::none);
  EXPECT_EQ(value_at(11), 0x22U);
  device.engine->release(at(12));
  EXPECT_EQ(value_at(21), 0x55U);
  EXPECT_EQ(value_at(31), 0x44U);
  EXPECT_EQ(value_at(41), 0U);
  device.engine->hold();
  for (unsigned sub = 0; sub < Engine::kMpdosWaiting; ++sub) {
    EXPECT_EQ(send(static_cast<std::uint8_t>(sub), 1), AbortCode::none);
  }
  EXPECT_EQ(send(Engine::kMpdosWaiting, 1), AbortCode::out_of_memory);
  device.engine->set_operational(false, at(50));
  device.engine->set_operational(true, at(50));
  device.engine->release(at(51));
  EXPECT_THAT(device.sent_ids(at(51)), IsEmpty()) << "discarded when leaving Operational";
}

TEST_F(MpdoTest, IsNotSentOtherwise) {
  EXPECT_FALSE(device.engine->trigger(1, at(1)));
  device.engine->sync(0, at(1));
  can::Frame remote;
  remote.id = 0x181;
  remote.flags = can::Frame::kRemote;
  device.receive(remote);
  EXPECT_FALSE(device.engine->request_rpdo(1));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

// Every value of TPDO 1 that does not make it an MPDO is refused.
TEST_F(MpdoTest, RefusalsOfTheRecords) {
  EXPECT_EQ(device.write(0x1800, 2, 1), AbortCode::parameter_incompatible);
  EXPECT_EQ(device.write(0x1800, 2, 254), AbortCode::none);
  EXPECT_EQ(device.write(0x1800, 1, kInvalid | 0x181), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 0, 254), AbortCode::parameter_incompatible) << "TPDO 2 scans";
  EXPECT_EQ(device.write(0x1A00, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 1, 0x20060040), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 0, 255), AbortCode::not_mappable) << "longer than 4 bytes";
  EXPECT_EQ(device.write(0x1A00, 1, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 0, 255), AbortCode::no_object);
  EXPECT_EQ(device.write(0x1A00, 1, 0x20050020), AbortCode::none);
  EXPECT_EQ(device.write(0x1800, 2, 1), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 0, 255), AbortCode::parameter_incompatible) << "synchronous";
  EXPECT_EQ(device.write(0x1800, 2, 255), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 0, 255), AbortCode::none);
  EXPECT_EQ(device.write(0x1800, 1, 0x182), AbortCode::none);
  EXPECT_EQ(device.engine->send_mpdo(1, 0, {0x6200, 1}), AbortCode::none);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x182));
}

TEST_F(MpdoTest, RefusalsOfTheLists) {
  EXPECT_EQ(device.write(0x1FA0, 1, 0x00'3000'00), AbortCode::no_object);
  EXPECT_EQ(device.write(0x1FA0, 1, 0x00'2100'09), AbortCode::no_sub_index);
  EXPECT_EQ(device.write(0x1FA0, 1, 0x00'2011'00), AbortCode::not_mappable) << "write-only";
  EXPECT_EQ(device.write(0x1FA0, 1, 0x00'2006'00), AbortCode::not_mappable) << "8 bytes";
  EXPECT_EQ(device.write(0x1FA0, 1, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1FD0, 1, 0x00'2003'00'3000'00'00), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1FD0, 1, 0x00'2003'00'3000'00'80), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1FD0, 1, 0x00'3000'00'3000'00'09), AbortCode::no_object);
  EXPECT_EQ(device.write(0x1FD0, 1, 0x00'2010'00'3000'00'09), AbortCode::not_mappable);
  EXPECT_EQ(device.write(0x1FD0, 1, 0), AbortCode::none);
}

TEST(MpdoConfigure, OfSeveralTpdosInSourceAddressModeTheFirstIsUsed) {
  od::DeviceDescription made = description();
  for (od::ObjectDescription& object : made.objects) {
    if (object.index == 0x1A00) {
      object.variables[0].value = {std::byte{254}};
    }
  }
  Device device(made);
  EXPECT_EQ(device.diagnostics.size(), 1U);
  EXPECT_THAT(device.listener.unusable, ElementsAre(RecordingListener::Unusable{
                                            {0x1A01, 0}, AbortCode::parameter_incompatible}));
}

// The consumer receives what the producer sends: 2100h:2 of the producer, node 9, is 2100h:1 of the
// consumer.
TEST(MpdoPair, FromScannerToDispatcher) {
  Device producer(description());
  Device consumer(description());
  producer.engine->set_node_id(9);
  producer.operational();
  consumer.operational();
  EXPECT_EQ(consumer.write(0x1FD0, 1, 0x02'2100'01'2100'02'09), AbortCode::none);
  EXPECT_EQ(consumer.write(0x1401, 1, kInvalid | 0x301), AbortCode::none);
  EXPECT_EQ(consumer.write(0x1401, 1, 0x281), AbortCode::none);
  ASSERT_TRUE(producer.dictionary.set({0x2100, 2}, 0xABCD));
  producer.engine->value_changed({0x2100, 2}, at(1));
  for (can::Frame frame : producer.sent(at(1))) {
    consumer.receive(frame);
  }
  EXPECT_EQ(consumer.read(0x2100, 1), 0xABCDU);
}

}  // namespace
}  // namespace linegate::pdo
