// SPDX-License-Identifier: Apache-2.0
// Objects that are added, removed and moved while PDOs map them, and watched objects.
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

od::DeviceDescription with_pdos() {
  od::DeviceDescription out = plain_device();
  add_rpdo(out, {.cob_id = 0x201, .mapping = {0x20020008, 0x20030010}});
  add_rpdo(out, {.number = 2, .cob_id = 0x301, .mapping = {0x20050020}});
  add_rpdo(out, {.number = 3, .cob_id = 0x401, .type = 0, .mapping = {0x20040018}});
  add_tpdo(out, {.cob_id = 0x181, .mapping = {0x20030010}});
  add_tpdo(out, {.number = 2, .cob_id = 0x281, .mapping = {0x20050020}});
  return out;
}

struct Changing : Device {
  Changing() : Device(with_pdos()) {
    EXPECT_THAT(diagnostics, IsEmpty());
    operational();
    EXPECT_THAT(sent_ids(at(0)), ElementsAre(0x181, 0x281));
  }
};

TEST(DictionaryChanges, PdosThatMapARemovedObjectStopAndAreTold) {
  Changing device;
  ASSERT_TRUE(device.dictionary.remove(0x2003));
  EXPECT_THAT(device.listener.unusable, ElementsAre(Unusable{{0x1600, 2}, AbortCode::no_object},
                                                    Unusable{{0x1A00, 1}, AbortCode::no_object}));
  device.receive(frame(0x201, {1, 2, 3}, at(1)));
  EXPECT_EQ(device.read(0x2002), 0U) << "a PDO is applied completely or not";
  device.engine->value_changed({0x2003, 0}, at(1));
  EXPECT_FALSE(device.engine->trigger(1, at(1)));
  EXPECT_THAT(device.sent(at(1)), IsEmpty());
  device.receive(frame(0x301, {1, 2, 3, 4}, at(1)));
  EXPECT_EQ(device.read(0x2005), 0x04030201U) << "other PDOs continue";
}

TEST(DictionaryChanges, PdosComeBackWithTheirObject) {
  Changing device;
  ASSERT_TRUE(device.dictionary.remove(0x2003));
  ASSERT_TRUE(device.dictionary.add(value(0x2003, DataType::unsigned16)));
  device.receive(frame(0x201, {1, 2, 3}, at(1)));
  EXPECT_EQ(device.read(0x2002), 1U);
  EXPECT_EQ(device.read(0x2003), 0x0302U);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x181));
}

// 2020h VISIBLE_STRING "ab".
od::DeviceDescription with_string() {
  od::DeviceDescription out = plain_device();
  od::ObjectDescription string = value(0x2020, DataType::visible_string);
  string.variables[0].value = {std::byte{'a'}, std::byte{'b'}};
  out.objects.push_back(string);
  return out;
}

// The bytes of a string move when the device writes a value longer than its memory.
TEST(DictionaryChanges, AStringThatGrewIsSentWhenItHasTheMappedLengthAgain) {
  od::DeviceDescription description = with_string();
  add_tpdo(description, {.cob_id = 0x181, .mapping = {0x20200010}});
  Device device(std::move(description));
  ASSERT_THAT(device.diagnostics, IsEmpty());
  device.operational();
  ASSERT_EQ(device.sent(at(0)).size(), 1U);
  const auto set = [&](std::size_t size, char character) {
    EXPECT_TRUE(device.dictionary.set(
        {0x2020, 0}, std::vector<std::byte>(size, static_cast<std::byte>(character))));
    device.engine->value_changed({0x2020, 0}, at(1));
  };
  set(100, 'c');
  EXPECT_THAT(device.sent(at(1)), IsEmpty());
  EXPECT_THAT(device.listener.unusable,
              ElementsAre(Unusable{{0x1A00, 1}, AbortCode::length_mismatch}));
  set(200, 'd');
  EXPECT_THAT(device.sent(at(1)), IsEmpty());
  for (const char character : {'e', 'f'}) {
    set(2, character);
    const std::vector<can::Frame> sent = device.sent(at(1));
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_THAT(data_of(sent[0]), ElementsAre(character, character));
  }
}

// Otherwise an RPDO would write into memory that no longer belongs to the string.
TEST(DictionaryChanges, AStringThatGrewIsReceivedWhenItHasTheMappedLengthAgain) {
  od::DeviceDescription description = with_string();
  add_rpdo(description, {.cob_id = 0x201, .mapping = {0x20200010}});
  Device device(std::move(description));
  ASSERT_THAT(device.diagnostics, IsEmpty());
  device.operational();
  for (const std::size_t size : {100U, 2U, 200U, 2U}) {
    EXPECT_TRUE(device.dictionary.set({0x2020, 0}, std::vector<std::byte>(size, std::byte{'c'})));
    device.receive(frame(0x201, {'x', 'y'}, at(1)));
    EXPECT_EQ(device.read(0x2020), size == 2 ? 0x7978U : ~std::uint64_t{0}) << size;
  }
}

TEST(DictionaryChanges, AnObjectOfAnotherLengthDoesNotFitTheOldMapping) {
  Changing device;
  ASSERT_TRUE(device.dictionary.remove(0x2003));
  device.listener.unusable.clear();
  ASSERT_TRUE(device.dictionary.add(value(0x2003, DataType::unsigned32)));
  EXPECT_THAT(device.listener.unusable,
              ElementsAre(Unusable{{0x1600, 2}, AbortCode::length_mismatch},
                          Unusable{{0x1A00, 1}, AbortCode::length_mismatch}));
}

TEST(DictionaryChanges, ARemovedObjectCannotBeMapped) {
  Changing device;
  ASSERT_TRUE(device.dictionary.remove(0x2006));
  ASSERT_EQ(device.write(0x1400, 1, 0x8000'0201), AbortCode::none);
  ASSERT_EQ(device.write(0x1600, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 1, 0x2006'0040), AbortCode::no_object);
  ASSERT_TRUE(device.dictionary.add(value(0x2006, DataType::unsigned64)));
  EXPECT_EQ(device.write(0x1600, 1, 0x2006'0040), AbortCode::none);
}

TEST(DictionaryChanges, AnObjectThatLivesElsewhereIsFollowed) {
  Changing device;
  std::array<std::byte, 16> elsewhere{};
  ASSERT_TRUE(device.dictionary.bind({0x2003, 0}, elsewhere.data()));
  device.receive(frame(0x201, {1, 2, 3}, at(1)));
  EXPECT_EQ(std::to_integer<unsigned>(elsewhere[0]), 2U);
  EXPECT_EQ(std::to_integer<unsigned>(elsewhere[1]), 3U);
}

TEST(DictionaryChanges, APdoWithoutItsRecordIsNone) {
  Changing device;
  ASSERT_TRUE(device.dictionary.remove(0x1801));
  device.engine->value_changed({0x2005, 0}, at(1));
  EXPECT_THAT(device.sent(at(1)), IsEmpty());
  od::DeviceDescription again;
  add_tpdo(again, {.number = 2, .cob_id = 0x282});
  ASSERT_TRUE(device.dictionary.add(again.objects[0]));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x282));
  EXPECT_EQ(device.write(0x1801, 1, 0x281), AbortCode::device_state)
      << "writes of the record are checked";
}

// No listener receives each RPDO, so the fast path of a frame is used.
struct Watching : Changing {
  struct Watcher : od::Hook {
    void came_by_rpdo(od::Address address) override { heard.push_back(address); }
    void written(od::Address address) override { stored.push_back(address); }
    std::vector<od::Address> heard;
    std::vector<od::Address> stored;
  };

  Watching() { engine->set_listener(&listener, false); }

  // Receives a frame as a node does.
  void hear(const can::Frame& frame) {
    can::Traffic traffic;
    if (engine->receive_ordinary({&frame, 1}, traffic) == 0) {
      receive(frame);
    }
  }

  Watcher watcher;
};

TEST(WatchedObjects, TellOfEveryRpdoThatBringsTheirValue) {
  Watching device;
  ASSERT_TRUE(device.dictionary.add_hook(0x2003, device.watcher, od::Watch::rpdos));
  (void)device.sent(at(0));
  device.hear(frame(0x201, {1, 2, 3}, at(1)));
  device.hear(frame(0x301, {1, 2, 3, 4}, at(1)));
  EXPECT_THAT(device.watcher.heard, ElementsAre(od::Address{0x2003, 0}));
  EXPECT_EQ(device.read(0x2003), 0x0302U);
  device.hear(frame(0x201, {1, 2, 3}, at(2)));
  EXPECT_EQ(device.watcher.heard.size(), 2U) << "the same value again";
  EXPECT_THAT(device.watcher.stored, IsEmpty());
}

TEST(WatchedObjects, OfSynchronousRpdosTellWithTheSync) {
  Watching device;
  ASSERT_TRUE(device.dictionary.add_hook(0x2004, device.watcher, od::Watch::rpdos));
  device.hear(frame(0x401, {1, 2, 3}, at(1)));
  EXPECT_THAT(device.watcher.heard, IsEmpty());
  device.engine->sync(0, at(2));
  EXPECT_THAT(device.watcher.heard, ElementsAre(od::Address{0x2004, 0}));
}

TEST(WatchedObjects, AreNotWatchedByHooksThatDoNotAskForIt) {
  Watching device;
  ASSERT_TRUE(device.dictionary.add_hook(0x2003, device.watcher));
  device.hear(frame(0x201, {1, 2, 3}, at(1)));
  EXPECT_THAT(device.watcher.heard, IsEmpty());
  EXPECT_EQ(device.write(0x2003, 0, 9), AbortCode::none);
  EXPECT_THAT(device.watcher.stored, ElementsAre(od::Address{0x2003, 0}));
}

TEST(WatchedObjects, AreWatchedUntilTheHookIsTakenAway) {
  Watching device;
  ASSERT_TRUE(device.dictionary.add_hook(0x2003, device.watcher, od::Watch::rpdos));
  device.dictionary.remove_hook(0x2003, device.watcher);
  device.hear(frame(0x201, {1, 2, 3}, at(1)));
  EXPECT_THAT(device.watcher.heard, IsEmpty());
  EXPECT_FALSE(device.dictionary.find({0x2003, 0})->watched);
}

}  // namespace
}  // namespace linegate::pdo
