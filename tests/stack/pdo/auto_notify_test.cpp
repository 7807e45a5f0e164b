// SPDX-License-Identifier: Apache-2.0
// TPDOs that are requested by a change of a mapped value.
#include <algorithm>
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/image/network_variables.h"

#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

using Pdos = std::vector<Pdo>;

// A device in Operational, after it has sent its initial frames.
struct Notifying : Device {
  explicit Notifying(const Pdos& tpdos, const Pdos& rpdos = {})
      : Device(description(tpdos, rpdos)) {
    EXPECT_THAT(diagnostics, IsEmpty());
    engine->set_auto_notify(true);
    operational();
    (void)sent(at(0));
  }
  static od::DeviceDescription description(const Pdos& tpdos, const Pdos& rpdos) {
    od::DeviceDescription out = plain_device();
    for (const Pdo& pdo : tpdos) {
      add_tpdo(out, pdo);
    }
    for (const Pdo& pdo : rpdos) {
      add_rpdo(out, pdo);
    }
    return out;
  }
  void set(std::uint16_t index, std::uint64_t value) {
    EXPECT_TRUE(dictionary.set({index, 0}, value));
  }
};

TEST(AutoNotify, IsOffUntilItIsWanted) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}},
                        {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}}});
  device.engine->set_auto_notify(false);
  device.set(0x2003, 1);
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  device.engine->set_auto_notify(2, true);
  device.set(0x2003, 2);
  EXPECT_TRUE(device.engine->wants_to_send(at(1)));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].id, 0x281U) << "auto-notify is set for each TPDO";
  EXPECT_THAT(data_of(sent[0]), ElementsAre(2, 0));
  device.engine->set_auto_notify(1, true);
  device.engine->set_auto_notify(2, false);
  device.set(0x2003, 3);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x181));
  device.engine->set_auto_notify(0, true);
  device.engine->set_auto_notify(513, true);
  device.engine->set_auto_notify(1, false);
  device.set(0x2003, 4);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

TEST(AutoNotify, HearsOfAValueWhoeverChangesIt) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010, 0x20020008}}});
  const auto sent_data = [&device] {
    const std::vector<can::Frame> sent = device.sent(at(1));
    return sent.size() == 1 ? data_of(sent[0]) : std::vector<unsigned>{};
  };
  device.set(0x2003, 0x0102);
  EXPECT_THAT(sent_data(), ElementsAre(2, 1, 0)) << "written by the device";
  EXPECT_EQ(device.write(0x2002, 0, 7), AbortCode::none);
  EXPECT_THAT(sent_data(), ElementsAre(2, 1, 7)) << "written by SDO";
  const std::array<std::byte, 2> first{std::byte{3}, std::byte{4}};
  const std::array<std::byte, 1> second{std::byte{5}};
  const od::Assignment group[] = {{{0x2003, 0}, first}, {{0x2002, 0}, second}};
  EXPECT_EQ(device.dictionary.write_all(group), AbortCode::none);
  EXPECT_THAT(sent_data(), ElementsAre(3, 4, 5)) << "one frame for a group";
  EXPECT_EQ(device.engine->counters().coalesced, 0U);
  device.set(0x2005, 1);
  EXPECT_THAT(sent_data(), IsEmpty()) << "the object is not mapped";
}

// A hook writes the value while another value is written.
TEST(AutoNotify, HearsOfWhatAHookSets) {
  struct Doubles : od::Hook {
    explicit Doubles(od::Dictionary& d) : dictionary(d) {}
    void written(od::Address) override {
      dictionary.set({0x2003, 0}, 2 * *dictionary.number({0x2002, 0}));
    }
    od::Dictionary& dictionary;
  };
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010, 0x20020008}}});
  Doubles hook(device.dictionary);
  ASSERT_TRUE(device.dictionary.add_hook(0x2002, hook));
  EXPECT_EQ(device.write(0x2002, 0, 7), AbortCode::none);
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(14, 0, 7));
  device.dictionary.remove_hook(0x2002, hook);
}

TEST(AutoNotify, OfEachTransmissionType) {
  for (unsigned type = 0; type <= 255; ++type) {
    if (type > 240 && type < 252) {
      continue;  // reserved transmission type: not a TPDO
    }
    Notifying device(
        Pdos{{.cob_id = 0x181, .type = static_cast<std::uint8_t>(type), .mapping = {0x20030010}}});
    device.engine->sync(0, at(1));
    (void)device.sent(at(1));
    device.set(0x2003, 1);
    EXPECT_EQ(device.sent(at(2)).size(), type >= 254 ? 1U : 0U) << type;
    device.engine->sync(0, at(3));
    EXPECT_EQ(device.sent(at(3)).size(), type <= 2 ? 1U : 0U) << type;
    device.engine->sync(0, at(4));
    EXPECT_EQ(device.sent(at(4)).size(), type == 1 || type == 3 ? 1U : 0U) << type;
  }
}

TEST(AutoNotify, TheSameValueOnceMoreIsNoEvent) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}},
                        {.number = 2, .cob_id = 0x281, .type = 0, .mapping = {0x20030010}}});
  device.engine->sync(0, at(1));
  (void)device.sent(at(1));
  device.set(0x2003, 0);
  EXPECT_EQ(device.write(0x2003, 0, 0), AbortCode::none);
  device.engine->sync(0, at(2));
  EXPECT_THAT(device.sent_ids(at(2)), IsEmpty());
  device.set(0x2003, 1);
  device.set(0x2003, 0);
  device.engine->sync(0, at(3));
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x181, 0x281)) << "the value changed meanwhile";
}

TEST(AutoNotify, RespectsTheInhibitTime) {
  Notifying device(Pdos{{.cob_id = 0x181, .inhibit = 100, .mapping = {0x20030010}}});
  device.set(0x2003, 1);
  EXPECT_FALSE(device.engine->wants_to_send(at(5)));
  EXPECT_THAT(device.sent_ids(at(5)), IsEmpty());
  EXPECT_EQ(device.engine->next_wake(), at(10));
  device.set(0x2003, 2);
  const std::vector<can::Frame> sent = device.sent(at(10));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(2, 0));
}

TEST(AutoNotify, WaitsForTheEndOfAGroupOfWrites) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010, 0x20020008}},
                        {.number = 2, .cob_id = 0x281, .type = 0, .mapping = {0x20020008}},
                        {.number = 3, .cob_id = 0x381, .mapping = {0x20010001}}});
  device.engine->hold();
  device.set(0x2003, 1);
  EXPECT_EQ(device.write(0x2002, 0, 2), AbortCode::none);
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  device.engine->sync(0, at(1));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281)) << "requested by Operational";
  device.engine->release(at(2));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(1, 0, 2));
  device.engine->sync(0, at(3));
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x281));
}

// A check would slow down every RPDO; od::Watch::rpdos exists for applications that need it.
TEST(AutoNotify, AnRpdoIsNotNoticed) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}}},
                   Pdos{{.cob_id = 0x201, .mapping = {0x20030010}}});
  device.receive(frame(0x201, {7, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 7U);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

TEST(AutoNotify, NothingIsSentOutsideOfOperational) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}}});
  device.engine->set_operational(false, at(1));
  device.set(0x2003, 1);
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

TEST(AutoNotify, GoesWithTheMapping) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}}});
  EXPECT_EQ(device.write(0x1800, 1, 0x8000'0181), AbortCode::none);
  device.set(0x2003, 1);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  EXPECT_EQ(device.write(0x1A00, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 1, 0x20050020), AbortCode::none);
  EXPECT_EQ(device.write(0x1A00, 0, 1), AbortCode::none);
  EXPECT_EQ(device.write(0x1800, 1, 0x181), AbortCode::none);
  (void)device.sent(at(2));
  device.set(0x2003, 2);
  EXPECT_THAT(device.sent_ids(at(2)), IsEmpty());
  EXPECT_FALSE(device.dictionary.find({0x2003, 0})->followed) << "the object is not followed";
  device.set(0x2005, 3);
  EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x181));
  EXPECT_THAT(device.engine->configure(), IsEmpty());
  (void)device.sent(at(3));
  device.set(0x2005, 4);
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x181)) << "the setting is kept";
}

TEST(AutoNotify, OutlivesAnObjectThatGoesAndComesBack) {
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20030010}}});
  ASSERT_TRUE(device.dictionary.remove(0x2003));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  ASSERT_TRUE(device.dictionary.add(value(0x2003, DataType::unsigned16)));
  (void)device.sent(at(2));
  device.set(0x2003, 1);
  EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x181));
  device.engine.reset();
  EXPECT_FALSE(device.dictionary.find({0x2003, 0})->followed);
}

// TPDOs of a manager to two devices, with 16 + 8 + 1 bits and 32 bits, all outputs valid.
struct Outputs : Manager {
  explicit Outputs(const od::DeviceDescription& device)
      : Manager({remote(device, 5, {remote_pdo(1, 0x205, {0x20030010, 0x20020008, 0x20000001})}),
                 remote(device, 6, {remote_pdo(1, 0x206, {0x20050020}, 0)})}) {
    for (std::uint32_t entry = 0; entry < plan.outputs.entries.size(); ++entry) {
      image->write_entry(image::Direction::outputs, entry, std::uint64_t{0});
    }
    engine->set_operational(false, at(0));
    engine->set_operational(true, at(0));
    engine->sync(0, at(0));
    (void)sent(at(0));
  }
  static RemoteNode remote(const od::DeviceDescription& device, std::uint8_t id,
                           std::vector<Parameters> rpdos) {
    RemoteNode out;
    out.id = id;
    out.device = &device;
    out.pdos = {{}, std::move(rpdos)};
    return out;
  }
  std::vector<std::uint32_t> sent(Instant now) {
    std::vector<std::uint32_t> ids;
    for (can::Frame frame; engine->next_frame(frame, now);) {
      ids.push_back(frame.id);
    }
    return ids;
  }
  // The network variable of an entry.
  od::Address variable(std::uint32_t entry) const {
    const image::Entry& place = plan.outputs.entries[entry];
    return {place.variable_index, place.variable_sub};
  }
};

TEST(AutoNotify, OfLinkedTpdosNoticesTheNetworkVariables) {
  const od::DeviceDescription device = plain_device();
  Outputs manager(device);
  ASSERT_EQ(manager.plan.outputs.entries.size(), 4U);
  ASSERT_TRUE(manager.dictionary.set(manager.variable(0), 8));
  EXPECT_THAT(manager.sent(at(1)), IsEmpty()) << "auto-notify is off";
  manager.engine->set_auto_notify(true);
  const std::vector<std::uint32_t> first{0x205};
  for (const std::uint32_t entry : {0U, 1U, 2U}) {
    const std::uint64_t other = manager.image->read_entry(image::Direction::outputs, entry) ^ 1U;
    ASSERT_TRUE(manager.dictionary.set(manager.variable(entry), other));
    EXPECT_EQ(manager.sent(at(1)), first) << entry;
    ASSERT_TRUE(manager.dictionary.set(manager.variable(entry), other));
    EXPECT_THAT(manager.sent(at(1)), IsEmpty()) << "the same value again";
  }
  ASSERT_TRUE(manager.dictionary.set(manager.variable(3), 7));
  EXPECT_THAT(manager.sent(at(1)), IsEmpty()) << "type 0 waits for SYNC";
  manager.engine->sync(0, at(2));
  EXPECT_EQ(manager.sent(at(2)), (std::vector<std::uint32_t>{0x206}));
  manager.engine->set_auto_notify(1, false);
  ASSERT_TRUE(manager.dictionary.set(manager.variable(0), 99));
  EXPECT_THAT(manager.sent(at(3)), IsEmpty()) << "auto-notify is set for each TPDO";
}

// The same byte as part of values of several types.
TEST(AutoNotify, OfLinkedTpdosNoticesVariablesOfEachType) {
  const od::DeviceDescription device = plain_device();
  Outputs manager(device);
  manager.engine->set_auto_notify(true);
  const std::uint32_t byte = manager.plan.outputs.entries[0].bit_offset / 8;
  std::uint8_t number = 0;
  constexpr std::array<std::uint16_t, 7> kBases{0xA000, 0xA040, 0xA0C0, 0xA100,
                                                0xA1C0, 0xA200, 0xA240};
  for (const std::uint16_t base : kBases) {
    const auto place = image::variable_place({base, 1});
    ASSERT_TRUE(place);
    const auto sub = static_cast<std::uint8_t>(1 + 8 * byte / place->bit_length);
    const std::vector<std::byte> value(place->bit_length / 8, std::byte{++number});
    ASSERT_TRUE(manager.dictionary.set({base, sub}, std::span<const std::byte>(value)))
        << std::hex << base;
    const std::vector<std::uint32_t> ids = manager.sent(at(1));
    EXPECT_NE(std::ranges::find(ids, 0x205U), ids.end()) << std::hex << base;
  }
}

// A value that was never written is not sent, whatever requests it.
TEST(AutoNotify, OfLinkedTpdosHoldsThemBackAsEver) {
  const od::DeviceDescription device = plain_device();
  Manager manager({Outputs::remote(device, 5, {remote_pdo(1, 0x205, {0x20030010})})});
  manager.engine->set_auto_notify(true);
  const image::Entry& entry = manager.plan.outputs.entries[0];
  ASSERT_TRUE(manager.dictionary.set({entry.variable_index, entry.variable_sub}, 1));
  EXPECT_FALSE(manager.engine->wants_to_send(at(1)));
}

// The listener counts its calls, in a value that TPDO 1 sends.
TEST(AutoNotify, AValueRefreshedForATpdoRequestsTheOthersOnly) {
  struct Counts : Listener {
    explicit Counts(Device& d) : device(d) {}
    void before_tpdo(std::uint16_t number) override {
      if (number == 1) {
        device.dictionary.set({0x2002, 0}, device.read(0x2002) + 1);
      }
    }
    Device& device;
  };
  Notifying device(Pdos{{.cob_id = 0x181, .mapping = {0x20020008}},
                        {.number = 2, .cob_id = 0x281, .mapping = {0x20020008}}});
  Counts counts(device);
  device.engine->set_listener(&counts);
  EXPECT_TRUE(device.engine->trigger(1, at(1)));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(1));
  EXPECT_THAT(data_of(sent[1]), ElementsAre(1));
  EXPECT_THAT(device.sent_ids(at(2)), IsEmpty());
}

}  // namespace
}  // namespace linegate::pdo
