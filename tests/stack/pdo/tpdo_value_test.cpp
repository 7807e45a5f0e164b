// SPDX-License-Identifier: Apache-2.0
// Values that are set by a handle, which contains the TPDO that sends them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/image/process_image.h"

#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

// A device in Operational, after it has sent its initial frames.
struct Sender : Device {
  // every_frame: see Engine::set_listener(); without it TPDOs are sampled and sent in the short
  // way.
  explicit Sender(std::initializer_list<Pdo> tpdos, bool every_frame = true)
      : Device(description(tpdos)) {
    engine->set_listener(&listener, every_frame);
    EXPECT_THAT(diagnostics, IsEmpty());
    operational();
    (void)sent(at(0));
  }
  static od::DeviceDescription description(std::initializer_list<Pdo> tpdos) {
    od::DeviceDescription out = plain_device();
    for (const Pdo& pdo : tpdos) {
      add_tpdo(out, pdo);
    }
    return out;
  }
  std::optional<TpdoValue> value(std::uint16_t index) const { return engine->value({index, 0}); }
};

TEST(TpdoValues, AreSentWhenTheyAreOtherOnes) {
  for (const bool every_frame : {true, false}) {
    SCOPED_TRACE(every_frame);
    Sender device({{.cob_id = 0x181, .mapping = {0x20020008, 0x20030010, 0x20050020}},
                   {.number = 2, .cob_id = 0x281, .mapping = {0x20060040}}},
                  every_frame);
    const auto u8 = device.value(0x2002);
    const auto u16 = device.value(0x2003);
    const auto u32 = device.value(0x2005);
    const auto u64 = device.value(0x2006);
    ASSERT_TRUE(u8 && u16 && u32 && u64);
    EXPECT_TRUE(device.engine->set(*u8, 0x101));
    EXPECT_TRUE(device.engine->set(*u16, 0x0302));
    EXPECT_TRUE(device.engine->set(*u32, 0x0706'0504));
    std::vector<can::Frame> sent = device.sent(at(1));
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_EQ(sent[0].id, 0x181U);
    EXPECT_THAT(data_of(sent[0]), ElementsAre(1, 2, 3, 4, 5, 6, 7)) << "the low bits of each";
    EXPECT_EQ(device.read(0x2003), 0x0302U);
    EXPECT_TRUE(device.engine->set(*u16, 0x0302));
    EXPECT_THAT(device.sent_ids(at(2)), IsEmpty()) << "the value did not change";
    EXPECT_TRUE(device.engine->set(*u64, 0x0807'0605'0403'0201));
    sent = device.sent(at(3));
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_THAT(data_of(sent[0]), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  }
}

TEST(TpdoValues, FollowTheRulesOfTheirTpdo) {
  for (const bool every_frame : {true, false}) {
    SCOPED_TRACE(every_frame);
    Sender device({{.cob_id = 0x181, .type = 0, .mapping = {0x20020008}},
                   {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}},
                   {.number = 3, .cob_id = 0x381, .type = 1, .mapping = {0x20050020}}},
                  every_frame);
    const auto at_sync = device.value(0x2002);
    const auto held = device.value(0x2003);
    const auto cyclic = device.value(0x2005);
    ASSERT_TRUE(at_sync && held && cyclic);
    EXPECT_TRUE(device.engine->set(*at_sync, 1));
    EXPECT_TRUE(device.engine->set(*cyclic, 1));
    EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
    device.engine->hold();
    EXPECT_TRUE(device.engine->set(*held, 1));
    EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
    device.engine->release(at(1));
    EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281));
    device.engine->sync(0, at(2));
    EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x181, 0x381));
    device.engine->set_operational(false, at(3));
    EXPECT_TRUE(device.engine->set(*held, 2));
    EXPECT_THAT(device.sent_ids(at(3)), IsEmpty());
    EXPECT_EQ(device.read(0x2003), 2U);
  }
}

TEST(TpdoValues, AreNumbersThatOneTpdoSends) {
  Sender device({{.cob_id = 0x181, .mapping = {0x20020008, 0x20040018}},
                 {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}},
                 {.number = 3, .cob_id = 0x381, .mapping = {0x20030010, 0x20050020}}});
  EXPECT_TRUE(device.value(0x2002));
  EXPECT_FALSE(device.value(0x2003)) << "two TPDOs send it";
  EXPECT_TRUE(device.value(0x2004)) << "24 bits";
  EXPECT_FALSE(device.value(0x2006)) << "no TPDO sends it";
  EXPECT_FALSE(device.value(0x3000)) << "there is no such object";
  od::Hook hook;
  ASSERT_TRUE(device.dictionary.set_hook(0x2005, &hook));
  EXPECT_FALSE(device.value(0x2005)) << "a hook follows the object";
  ASSERT_TRUE(device.dictionary.set_hook(0x2005, nullptr));
  EXPECT_TRUE(device.value(0x2005));
}

TEST(TpdoValues, AreFoundAnewWhenPdosChange) {
  for (const bool every_frame : {true, false}) {
    SCOPED_TRACE(every_frame);
    Sender device({{.cob_id = 0x181, .mapping = {0x20020008}},
                   {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}}},
                  every_frame);
    const auto before = device.value(0x2003);
    ASSERT_TRUE(before);
    ASSERT_EQ(device.write(0x1801, 1, kInvalid | 0x281), AbortCode::none);
    EXPECT_FALSE(device.engine->set(*before, 1));
    EXPECT_EQ(device.read(0x2003), 0U) << "the value is unchanged";
    EXPECT_FALSE(device.value(0x2003));
    ASSERT_EQ(device.write(0x1801, 1, 0x282), AbortCode::none);
    (void)device.sent(at(1));
    const auto after = device.value(0x2003);
    ASSERT_TRUE(after);
    EXPECT_FALSE(device.engine->set(*before, 1));
    EXPECT_TRUE(device.engine->set(*after, 1));
    EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x282));
  }
}

// The listener sets the value when the TPDO is about to be sampled: the sample contains it.
TEST(TpdoValues, MayBeSetWhileTheyAreSampled) {
  struct Refresh : Listener {
    explicit Refresh(Device& d) : device(d) {}
    void before_tpdo(std::uint16_t /*number*/) override {
      EXPECT_TRUE(device.engine->set(*device.engine->value({0x2002, 0}), ++count));
    }
    Device& device;
    std::uint8_t count = 0;
  };
  Sender device{{.cob_id = 0x181, .mapping = {0x20020008}}};
  Refresh refresh(device);
  device.engine->set_listener(&refresh);
  EXPECT_TRUE(device.engine->trigger(1, at(1)));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(1));
}

// Values that changed without a request are part of the next frame.
TEST(TpdoValues, AreSentWithTheNewestOtherValues) {
  for (const bool every_frame : {true, false}) {
    SCOPED_TRACE(every_frame);
    Sender device({{.cob_id = 0x181, .mapping = {0x20020008, 0x20030010}}}, every_frame);
    const auto u8 = device.value(0x2002);
    ASSERT_TRUE(u8);
    ASSERT_EQ(device.write(0x2003, 0, 0x0302), AbortCode::none);
    EXPECT_THAT(device.sent_ids(at(1)), IsEmpty()) << "without auto-notify";
    EXPECT_TRUE(device.engine->set(*u8, 1));
    const std::vector<can::Frame> sent = device.sent(at(1));
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_THAT(data_of(sent[0]), ElementsAre(1, 2, 3));
  }
}

// The inhibit time delays the newest value, and the event timer repeats it.
TEST(TpdoValues, KeepTheTimesOfTheirTpdo) {
  for (const bool every_frame : {true, false}) {
    SCOPED_TRACE(every_frame);
    Sender device({{.cob_id = 0x181, .inhibit = 100, .event_timer = 50, .mapping = {0x20020008}}},
                  every_frame);
    const auto value = device.value(0x2002);
    ASSERT_TRUE(value);
    EXPECT_TRUE(device.engine->set(*value, 1));
    EXPECT_THAT(device.sent_ids(at(9)), IsEmpty());
    EXPECT_TRUE(device.engine->set(*value, 2));
    const std::vector<can::Frame> sent = device.sent(at(10));
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_THAT(data_of(sent[0]), ElementsAre(2));
    EXPECT_EQ(device.engine->counters().coalesced, 1U);
    device.engine->advance(at(60));
    EXPECT_THAT(device.sent_ids(at(60)), ElementsAre(0x181));
  }
}

// Frames are counted, and marked in an image if there is one.
TEST(TpdoValues, AreCountedAndMarked) {
  for (const bool with_image : {true, false}) {
    SCOPED_TRACE(with_image);
    od::Dictionary dictionary(sorted(Sender::description(
        {{.cob_id = 0x181, .mapping = {0x20020008}},
         {.number = 2, .cob_id = can::CobId::kExtendedBit | 0x18181, .mapping = {0x20030010}}})));
    can::Dispatch dispatch;
    EventLog events;
    image::ProcessImage image;
    Engine engine(dictionary, dispatch, events, with_image ? &image : nullptr);
    EXPECT_THAT(engine.configure(), IsEmpty());
    engine.set_operational(true, at(0));
    can::Frame frame;
    while (engine.next_frame(frame, at(0))) {
    }
    EXPECT_TRUE(engine.set(*engine.value({0x2002, 0}), 1));
    EXPECT_TRUE(engine.set(*engine.value({0x2003, 0}), 1));
    can::Traffic sent;
    while (engine.next_frame(frame, at(7), 0, sent)) {
    }
    EXPECT_EQ(sent.frames, 2U);
    EXPECT_EQ(sent.extended, 1U);
    EXPECT_EQ(sent.bytes, 3U);
    EXPECT_EQ(engine.counters().sent, 4U);
    for (std::size_t slot = 0; with_image && slot < 2; ++slot) {
      EXPECT_EQ(image.area(image::Direction::outputs).pdo(slot).last, at(7));
      EXPECT_EQ(image.area(image::Direction::outputs).pdo(slot).count, 2U);
    }
  }
}

// While PDOs are compiled, no handle is valid: the TPDO of an earlier one may be gone.
TEST(TpdoValues, AreInvalidWhileThePdosAreCompiled) {
  struct SetWhenReported : Listener {
    void pdo_unusable(od::Address /*place*/, AbortCode /*why*/) override {
      was_set = device->engine->set(*before, 1);
      ++reports;
    }
    Sender* device = nullptr;
    std::optional<TpdoValue> before;
    bool was_set = false;
    int reports = 0;
  } listener;
  Sender device({{.cob_id = 0x181, .mapping = {0x20020008}},
                 {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}}});
  listener.device = &device;
  ASSERT_TRUE(device.dictionary.remove(0x2003));
  listener.before = device.value(0x2002);
  ASSERT_TRUE(listener.before);
  device.engine->set_listener(&listener, false);
  EXPECT_EQ(device.engine->configure().size(), 1U);
  EXPECT_EQ(listener.reports, 1);
  EXPECT_FALSE(listener.was_set);
  EXPECT_EQ(device.read(0x2002), 0U);
}

// Of many TPDOs the one with the highest priority on the bus is sent first, wherever its bit is.
TEST(TpdoValues, GoInTheOrderOfTheBus) {
  od::DeviceDescription description;
  constexpr std::uint16_t kMany = 300;
  for (std::uint16_t i = 0; i < kMany; ++i) {
    const auto index = static_cast<std::uint16_t>(0x2000 + i);
    description.objects.push_back(value(index, DataType::unsigned16));
    add_tpdo(description, {.number = static_cast<std::uint16_t>(i + 1),
                           .cob_id = 0x200U + kMany - i,
                           .mapping = {std::uint32_t{index} << 16U | 16U}});
  }
  Device device(std::move(description));
  device.operational();
  EXPECT_EQ(device.sent(at(0)).size(), kMany);
  for (const unsigned i : {7U, 299U, 150U, 64U, 0U}) {
    const auto value = device.engine->value({static_cast<std::uint16_t>(0x2000 + i), 0});
    ASSERT_TRUE(value);
    EXPECT_TRUE(device.engine->set(*value, 1));
  }
  EXPECT_THAT(device.sent_ids(at(1)),
              ElementsAre(0x200 + 1, 0x200 + 150, 0x200 + 236, 0x200 + 293, 0x200 + 300));
}

}  // namespace
}  // namespace linegate::pdo
