// SPDX-License-Identifier: Apache-2.0
// The application of own devices (role device): the events that it receives, and the values that it
// writes.
#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/device_file.h"
#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint8_t kDevice = 20;

od::ObjectDescription variable(std::uint16_t index, od::DataType type, od::Access access,
                               std::vector<std::byte> value = {}) {
  od::ObjectDescription out{.index = index, .name = "Variable", .type = od::ObjectType::variable};
  out.variables.push_back({.sub = 0, .type = type, .access = access, .value = std::move(value)});
  return out;
}

std::vector<std::byte> letters(std::string_view text) {
  std::vector<std::byte> out;
  for (const char c : text) {
    out.push_back(static_cast<std::byte>(c));
  }
  return out;
}

class DevicesApplication : public LineTest {
 protected:
  void SetUp() override {
    LineConfig config = config_of_devices();
    DeviceConfig device{.id = kDevice,
                        .name = "axis",
                        .device = *eds::load(kDeviceFile, "axis.eds", kDevice).value};
    auto& objects = device.device.objects;
    objects.push_back(variable(0x1002, od::DataType::unsigned32, od::Access::ro));
    objects.push_back(
        variable(0x1008, od::DataType::visible_string, od::Access::constant, letters("axis")));
    objects.push_back(variable(0x1012, od::DataType::unsigned32, od::Access::rw,
                               {std::byte{}, std::byte{1}, std::byte{}, std::byte{0x80}}));
    objects.push_back(variable(0x1F50, od::DataType::domain, od::Access::rw));
    objects.push_back(variable(0x2100, od::DataType::unsigned16, od::Access::rw));
    std::ranges::sort(objects, {}, &od::ObjectDescription::index);
    config.devices.push_back(std::move(device));
    make(std::move(config));
    line_->start(now_);
    hear(0x000, {0x01, 0x00});
    sent();
    events();
  }

  std::vector<Event> of_kind(EventKind kind) {
    std::vector<Event> all = events();
    std::erase_if(all, [kind](const Event& e) { return e.kind() != kind; });
    return all;
  }
  static constexpr bool kAsOwner = true;
  Error ask(std::uint16_t index, std::vector<std::byte> data, bool as_owner = false) {
    line_->execute({.request = LocalWrite{.node = kDevice,
                                          .address = {index, 0},
                                          .as_owner = as_owner,
                                          .data = std::move(data)}},
                   now_);
    return answer().error;
  }
  std::vector<std::byte> value_of(std::uint16_t index) {
    const auto value = line_->dictionary().read({index, 0});
    return value.ok() ? std::vector(value->begin(), value->end()) : std::vector<std::byte>{};
  }
};

TEST_F(DevicesApplication, HearsOfWritesToObjectsThatAreNotInTheImage) {
  hear(0x600 + kDevice, {0x2B, 0x00, 0x21, 0x00, 0x34, 0x12, 0, 0});
  const std::vector<Event> written = of_kind(EventKind::object_written);
  ASSERT_EQ(written.size(), 1U);
  EXPECT_EQ(written[0].node, kDevice);
  const auto& object = std::get<event::ObjectWritten>(written[0].data);
  EXPECT_EQ(object.size, 2U);
  EXPECT_EQ(object.index, 0x2100);
  EXPECT_EQ(load_le<std::uint16_t>(object.data.data()), 0x1234);
  hear(0x600 + kDevice, {0x23, 0x02, 0x20, 0x00, 1, 0, 0, 0});
  EXPECT_THAT(of_kind(EventKind::object_written), IsEmpty()) << "the image shows it";
  hear(0x600 + kDevice, {0x2B, 0x02, 0x10, 0x00, 1, 0, 0, 0});
  EXPECT_THAT(of_kind(EventKind::object_written), IsEmpty()) << "the write was refused";
  EXPECT_EQ(ask(0x2100, {std::byte{7}, std::byte{0}}), Error{});
  EXPECT_THAT(of_kind(EventKind::object_written), IsEmpty()) << "written by the application itself";
}

// A master writes the object in each of its cycles.
TEST_F(DevicesApplication, OfAnObjectThatIsWrittenCyclicallyTheNewestValueIsReported) {
  std::vector<event::ObjectWritten> all;
  const auto collect = [&] {
    for (const Event& event : events()) {
      EXPECT_NE(event.kind(), EventKind::events_lost);
      if (const auto* const written = event.get<event::ObjectWritten>()) {
        all.push_back(*written);
      }
    }
  };
  constexpr std::uint8_t kWrites = 200;
  for (std::uint8_t i = 1; i <= kWrites; ++i) {
    hear(0x600 + kDevice, {0x2B, 0x00, 0x21, 0x00, i, 0, 0, 0});
    pass(milliseconds(1));
    sent();
    collect();
  }
  EXPECT_LT(all.size(), 10U);
  pass(seconds(2));
  collect();
  ASSERT_LT(all.size(), 10U);
  EXPECT_EQ(all.front().data[0], std::byte{1});
  EXPECT_EQ(all.back().data[0], std::byte{kWrites});
  EXPECT_EQ(all.back().suppressed, kWrites - all.size()) << "writes without an event";
}

TEST_F(DevicesApplication, HearsWhichResetItWas) {
  hear(0x000, {0x81, kDevice});
  auto reset = of_kind(EventKind::own_reset);
  ASSERT_EQ(reset.size(), 1U);
  EXPECT_EQ(reset[0].node, kDevice);
  EXPECT_EQ(reset[0].data, EventData(event::OwnReset{nmt::Command::reset_node}));
  hear(0x000, {0x82, 0x00});
  reset = of_kind(EventKind::own_reset);
  ASSERT_EQ(reset.size(), 1U);
  EXPECT_EQ(reset[0].data, EventData(event::OwnReset{nmt::Command::reset_communication}));
}

TEST_F(DevicesApplication, HearsTheBootUpOfOthersAndTime) {
  hear(0x705, {0x00});
  hear(0x705, {0x00});
  hear(0x706, {0x05});
  const auto booted = of_kind(EventKind::boot_up);
  ASSERT_EQ(booted.size(), 1U) << "at most one event a second";
  EXPECT_EQ(booted[0].node, 5);
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});  // TIME: one second of the second day
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});
  const auto told = of_kind(EventKind::time_received);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, kDevice);
  constexpr std::int64_t kSeconds = 441'763'200 + 86'400 + 1;  // 1984-01-01 since 1970
  EXPECT_EQ(std::get<event::TimeReceived>(told[0].data).utc, seconds(kSeconds));
}

TEST_F(DevicesApplication, HearsEachTimeOfAProducerThatSendsItEverySecond) {
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});
  now_ += milliseconds(1010);
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});
  now_ += milliseconds(990);
  hear(0x100, {0xE8, 0x03, 0, 0, 1, 0});
  EXPECT_EQ(of_kind(EventKind::time_received).size(), 3U);
}

TEST_F(DevicesApplication, SetsItsOwnValuesWhateverTheirAccess) {
  const std::vector<std::byte> status{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
  EXPECT_EQ(ask(0x1002, status), to_error(AbortCode::read_only));
  EXPECT_EQ(ask(0x1002, status, kAsOwner), Error{});
  EXPECT_EQ(value_of(0x1002), status);
  const std::string name(300, 'x');
  EXPECT_EQ(ask(0x1008, letters(name), kAsOwner), Error{});
  EXPECT_EQ(value_of(0x1008), letters(name)) << "longer than its default";
  hear(0x000, {0x81, kDevice});
  EXPECT_EQ(value_of(0x1002), status) << "a reset keeps own values";
  EXPECT_EQ(value_of(0x1008), letters(name));
  EXPECT_EQ(ask(0x1000, status, kAsOwner), to_error(AbortCode::unsupported_access));
  EXPECT_EQ(ask(0x2FFF, status, kAsOwner), to_error(AbortCode::no_object));
  EXPECT_EQ(ask(0x1002, {std::byte{1}}, kAsOwner), to_error(AbortCode::length_mismatch));
}

TEST_F(DevicesApplication, ResetCommunicationLeavesWhatAMasterWroteOfTheApplicationObjects) {
  const std::vector<std::byte> own{std::byte{3}, std::byte{0}};
  const std::vector<std::byte> of_master{std::byte{5}, std::byte{0}};
  EXPECT_EQ(ask(0x2100, own, kAsOwner), Error{});
  hear(0x600 + kDevice, {0x2B, 0x00, 0x21, 0x00, 0x05, 0x00, 0, 0});
  hear(0x000, {0x82, kDevice});
  EXPECT_EQ(value_of(0x2100), of_master);
  hear(0x000, {0x81, kDevice});
  EXPECT_EQ(value_of(0x2100), own);
}

TEST_F(DevicesApplication, HasADomainOf16Megabytes) {
  std::vector<std::byte> program(std::size_t{16} * 1024 * 1024, std::byte{0x5A});
  EXPECT_EQ(ask(0x1F50, program), Error{});
  EXPECT_EQ(value_of(0x1F50), program);
  program.push_back({});
  EXPECT_EQ(ask(0x1F50, program), to_error(AbortCode::length_too_high));
}

TEST_F(DevicesApplication, SendsAMappedObjectByWritingIt) {
  const auto frames_of = [&](std::uint32_t position) {
    line_->execute({.request = LocalWrite{.node = kDevice,
                                          .address = {0x2000, 0},
                                          .as_owner = true,
                                          .data = {std::byte{5}, std::byte{0}}}},
                   now_);
    EXPECT_TRUE(answer().ok()) << position;
    return sent();
  };
  EXPECT_THAT(frames_of(1), ElementsAre("194#050000000000"));
  EXPECT_THAT(frames_of(2), IsEmpty()) << "unchanged: only a trigger sends it";
}

// A program of 3 MiB in segments.
TEST_F(DevicesApplication, TakesAProgramOfMegabytes) {
  constexpr std::uint32_t kSize = 3 * 1024 * 1024;
  hear(0x600 + kDevice, {0x21, 0x50, 0x1F, 0x00, kSize & 0xFFU, kSize >> 8U & 0xFFU,
                         kSize >> 16U & 0xFFU, kSize >> 24U});
  EXPECT_THAT(sent(), ElementsAre("594#60501F0000000000"));
  std::uint32_t left = kSize;
  for (bool toggle = false; left > 0; toggle = !toggle) {
    const std::uint32_t bytes = std::min<std::uint32_t>(left, 7);
    left -= bytes;
    const auto head = static_cast<std::uint8_t>((toggle ? 0x10U : 0U) | (7 - bytes) << 1U |
                                                (left == 0 ? 1U : 0U));
    hear(0x600 + kDevice, {head, 1, 2, 3, 4, 5, 6, 7});
    ASSERT_EQ(sent().size(), 1U);
  }
  EXPECT_EQ(value_of(0x1F50).size(), kSize);
  const auto written = of_kind(EventKind::object_written);
  ASSERT_EQ(written.size(), 1U);
  EXPECT_EQ(std::get<event::ObjectWritten>(written[0].data).size, kSize);
}

}  // namespace
}  // namespace linegate::line
