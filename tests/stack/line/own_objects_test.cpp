// SPDX-License-Identifier: Apache-2.0
// Application objects of the own node (IXXAT CANopen Manager API manual 5.15).
#include "stack/line/own_objects.h"

#include <algorithm>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::byte> bytes_le(std::uint64_t value, std::size_t size) {
  std::vector<std::byte> out(size);
  store_le(std::span(out), value);
  return out;
}

OwnObject own(std::uint16_t index, std::uint8_t sub, od::DataType type, od::Access access) {
  OwnObject out{.index = index, .variable = {}};
  out.variable.sub = sub;
  out.variable.name = "Value " + std::to_string(sub);
  out.variable.type = type;
  out.variable.access = access;
  return out;
}

// A recipe that other nodes write, and a result that the application writes.
LineConfig config_with_objects() {
  LineConfig config = config_with_axis();
  OwnObject recipe = own(0x2100, 1, od::DataType::unsigned16, od::Access::rww);
  recipe.variable.name = "Recipe";
  recipe.variable.value = bytes_le(5, 2);
  recipe.variable.high_limit = bytes_le(100, 2);
  recipe.variable.mappable = true;
  recipe.in_image = true;
  OwnObject result = own(0x6100, 0, od::DataType::unsigned32, od::Access::ro);
  result.variable.mappable = true;
  result.in_image = true;
  config.own_objects = {result, recipe,
                        own(0x2100, 2, od::DataType::visible_string, od::Access::rw)};
  return config;
}

class OwnObjectsTest : public LineTest {
 protected:
  void run(LineConfig config) {
    make(std::move(config));
    boot();
    sent();
    events();
  }
  Reply ask(Command command) {
    line_->execute(std::move(command), now_);
    return answer();
  }
  Reply read(std::uint16_t index, std::uint8_t sub) {
    return ask({.request = LocalRead{.what = od::Address{index, sub}}});
  }
  Reply write(std::uint16_t index, std::uint8_t sub, std::vector<std::byte> data) {
    return ask({.request = LocalWrite{.address = {index, sub}, .data = std::move(data)}});
  }
  const image::Entry& last_entry(Direction direction) {
    return line_->layout(direction).entries.back();
  }
  std::uint64_t image_value(Direction direction) {
    const image::Snapshot now = snapshot(direction);
    const image::Entry& entry = last_entry(direction);
    EXPECT_TRUE(now.is_valid(line_->layout(direction).entries.size() - 1));
    return load_le(
        std::span<const std::byte>(now.bytes).subspan(entry.bit_offset / 8, entry.bit_length / 8));
  }
  void set_result(std::uint32_t value) {
    const std::size_t last = line_->layout(Direction::outputs).entries.size() - 1;
    const SingleOutput output{.entry = static_cast<std::uint32_t>(last),
                              .data = bytes_le(value, 4)};
    EXPECT_TRUE(ask({.request = output}).ok());
  }
  static OwnObject object(std::uint16_t index, std::uint8_t sub, od::DataType type,
                          std::uint64_t value = 0) {
    OwnObject out{.index = index};
    out.variable.sub = sub;
    out.variable.name = "new";
    out.variable.type = type;
    out.variable.value = bytes_le(value, od::byte_size(type));
    return out;
  }
  static Command create(OwnObject object) {
    return {.request = ObjectCreate{.what = std::move(object)}};
  }
  static Command create(std::uint16_t index, std::uint8_t sub, od::DataType type,
                        std::uint64_t value = 0) {
    return create(object(index, sub, type, value));
  }
  static Command create_in_image(std::uint16_t index, od::DataType type, std::uint32_t offset) {
    OwnObject out = object(index, 0, type);
    out.in_image = true;
    out.offset = offset;
    return create(std::move(out));
  }
  static Command remove(std::uint16_t index) {
    return {.request = ObjectCreate{.what = ObjectRemoval{index}}};
  }
};

TEST_F(OwnObjectsTest, ThoseOfTheConfigurationAreInTheDictionary) {
  run(config_with_objects());
  EXPECT_EQ(read(0x2100, 0).bytes(), bytes_le(2, 1)) << "the highest sub-index";
  EXPECT_EQ(read(0x2100, 1).bytes(), bytes_le(5, 2));
  EXPECT_EQ(write(0x2100, 1, bytes_le(101, 2)).error, to_error(AbortCode::value_too_high));
  EXPECT_TRUE(write(0x2100, 1, bytes_le(7, 2)).ok());
  EXPECT_TRUE(write(0x2100, 2, bytes_le('x', 1)).ok());
  EXPECT_EQ(write(0x6100, 0, bytes_le(1, 4)).error, to_error(AbortCode::read_only));
  hear(0x67F, {0x40, 0x00, 0x21, 0x01, 0, 0, 0, 0});
  EXPECT_THAT(sent(), ElementsAre("5FF#4B00210107000000")) << "readable over the bus, too";
}

TEST_F(OwnObjectsTest, WhatOthersWriteIsInTheInputs) {
  run(config_with_objects());
  const image::Entry& entry = last_entry(Direction::inputs);
  EXPECT_EQ(entry.node, 127);
  EXPECT_EQ(entry.index, 0x2100);
  EXPECT_EQ(entry.local_pdo, 0);
  EXPECT_EQ(entry.name, "own.Recipe");
  EXPECT_EQ(image_value(Direction::inputs), 5U) << "the default value";
  hear(0x67F, {0x2B, 0x00, 0x21, 0x01, 9, 0, 0, 0});
  EXPECT_TRUE(line_->image_changed(Direction::inputs));
  EXPECT_EQ(image_value(Direction::inputs), 9U);
  const auto input =
      line_->input(static_cast<std::uint32_t>(line_->layout(Direction::inputs).entries.size() - 1));
  EXPECT_EQ(input.value, 9U);
  EXPECT_TRUE(input.valid);
  EXPECT_FALSE(input.late);
}

TEST_F(OwnObjectsTest, WhatTheApplicationGivesIsInTheOutputs) {
  run(config_with_objects());
  set_result(0x11223344);
  EXPECT_EQ(read(0x6100, 0).bytes(), bytes_le(0x11223344, 4));
  EXPECT_EQ(image_value(Direction::outputs), 0x11223344U);
}

TEST_F(OwnObjectsTest, AResetGivesThemTheirDefaults) {  // 1010h
  run(config_with_objects());
  write(0x2100, 1, bytes_le(7, 2));
  snapshot(Direction::inputs);
  Command reset{.request = NmtRequest{.node = 127, .command = nmt::Command::reset_node}};
  ask(reset);
  pass(milliseconds(1));
  EXPECT_TRUE(line_->image_changed(Direction::inputs));
  EXPECT_EQ(image_value(Direction::inputs), 5U);
  EXPECT_EQ(read(0x2100, 1).bytes(), bytes_le(5, 2));
}

TEST_F(OwnObjectsTest, PdosMapThem) {
  LineConfig config = config_with_objects();
  pdo::Parameters tpdo;
  tpdo.number = 10;
  tpdo.cob_id = {0x3AA | can::CobId::kNoRtrBit};
  tpdo.mapping = {{{0x6100, 0}, 32}};
  config.forwarding.tpdos = {tpdo};
  pdo::Parameters rpdo;
  rpdo.number = 10;
  rpdo.cob_id = {0x3BB};
  rpdo.mapping = {{{0x2100, 1}, 16}};
  config.forwarding.rpdos = {rpdo};
  run(std::move(config));
  set_result(4);
  EXPECT_THAT(sent(), ElementsAre("3AA#04000000"));
  hear(0x3BB, {0x21, 0});
  EXPECT_EQ(image_value(Direction::inputs), 0x21U);
  EXPECT_EQ(read(0x2100, 1).bytes(), bytes_le(0x21, 2));
}

TEST_F(OwnObjectsTest, ThoseThatAreMarkedAreStored) {
  LineConfig config = config_with_objects();
  config.stores_parameters = true;
  config.own_objects[2].variable.store = true;
  run(std::move(config));
  EXPECT_THAT(line_->dictionary().stored(0x2000, 0x5FFF), ElementsAre(od::Address{0x2100, 2}));
}

TEST_F(OwnObjectsTest, WhatMakesNoSenseIsTold) {
  LineConfig config = config_with_axis();
  OwnObject long_value = own(0x2100, 1, od::DataType::unsigned16, od::Access::rw);
  long_value.variable.value = bytes_le(5, 4);
  OwnObject bit = own(0x2101, 0, od::DataType::boolean, od::Access::rw);
  bit.in_image = true;
  OwnObject text = own(0x2102, 0, od::DataType::visible_string, od::Access::rw);
  text.variable.mappable = true;
  config.own_objects = {own(0x5F00, 0, od::DataType::unsigned8, od::Access::rw),
                        own(0x1F00, 0, od::DataType::unsigned8, od::Access::rw),
                        own(0x2103, 0, od::DataType::domain, od::Access::rw),
                        long_value,
                        bit,
                        text,
                        own(0x2104, 0, od::DataType::unsigned8, od::Access::rw),
                        own(0x2104, 0, od::DataType::unsigned8, od::Access::rw)};
  const auto made = Line::make(config);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.diagnostics.size(), 7U);
  EXPECT_THAT(made.diagnostics.front().text,
              HasSubstr("own object 5F00:00 is not in 2000h..5EFFh or 6000h..9FFFh"));
  EXPECT_THAT(made.diagnostics.back().text, HasSubstr("own object 2104:00 is there twice"));
}

TEST_F(OwnObjectsTest, LimitsAndDefaultGoTogether) {
  const auto fault = [](unsigned low, unsigned high, std::optional<unsigned> value) {
    OwnObject object = own(0x2100, 1, od::DataType::unsigned8, od::Access::rw);
    object.variable.low_limit = bytes_le(low, 1);
    object.variable.high_limit = bytes_le(high, 1);
    object.variable.value = value ? bytes_le(*value, 1) : std::vector<std::byte>();
    return std::string(fault_of(object));
  };
  EXPECT_EQ(fault(5, 7, 6), "");
  EXPECT_EQ(fault(5, 7, std::nullopt), "");
  EXPECT_EQ(fault(5, 7, 9), "has a default beyond its limits");
  EXPECT_EQ(fault(5, 7, 4), "has a default beyond its limits");
  EXPECT_EQ(fault(7, 5, 6), "has a lower limit above the upper one");
  EXPECT_EQ(fault(7, 5, std::nullopt), "has a lower limit above the upper one");
}

TEST_F(OwnObjectsTest, ACommandCreatesAndRemovesThem) {  // 1010h
  run(config_with_axis());
  EXPECT_TRUE(ask(create(0x2200, 1, od::DataType::unsigned16, 3)).ok());
  EXPECT_EQ(read(0x2200, 1).bytes(), bytes_le(3, 2));
  write(0x2200, 1, bytes_le(4, 2));
  EXPECT_TRUE(ask(create(0x2200, 2, od::DataType::unsigned8, 8)).ok());
  EXPECT_EQ(read(0x2200, 1).bytes(), bytes_le(4, 2)) << "other objects keep their values";
  EXPECT_EQ(read(0x2200, 2).bytes(), bytes_le(8, 1));
  EXPECT_EQ(read(0x2200, 0).bytes(), bytes_le(2, 1));
  EXPECT_TRUE(ask(remove(0x2200)).ok());
  EXPECT_EQ(read(0x2200, 1).error, to_error(AbortCode::no_object));
  EXPECT_EQ(ask(remove(0x2200)).error, to_error(Refusal::unknown_entry));
}

TEST_F(OwnObjectsTest, ACreatedObjectMayLieOverTheImage) {
  run(config_with_objects());
  const std::uint32_t offset = last_entry(Direction::inputs).bit_offset / 8;
  EXPECT_TRUE(ask(create_in_image(0x2200, od::DataType::unsigned8, offset)).ok());
  EXPECT_EQ(read(0x2200, 0).bytes(), bytes_le(5, 1)) << "the bytes there are its value";
  snapshot(Direction::inputs);
  write(0x2200, 0, bytes_le(6, 1));
  EXPECT_TRUE(line_->image_changed(Direction::inputs));
  EXPECT_EQ(image_value(Direction::inputs), 6U);
  EXPECT_EQ(read(0x2100, 1).bytes(), bytes_le(6, 2));
}

TEST_F(OwnObjectsTest, CreatingHasItsLimits) {
  run(config_with_objects());
  const Error bad = to_error(Refusal::bad_request);
  const Error state = to_error(Refusal::wrong_state);
  EXPECT_EQ(ask(create(0x2100, 1, od::DataType::unsigned8)).error, state) << "the object exists";
  EXPECT_EQ(ask(remove(0x2100)).error, state) << "the object is configured";
  EXPECT_EQ(ask(create(0x1008, 0, od::DataType::unsigned8)).error, bad);
  EXPECT_EQ(ask(create(0x2200, 0, od::DataType::domain)).error, bad);
  OwnObject stored = object(0x2200, 0, od::DataType::unsigned8);
  stored.variable.store = true;
  EXPECT_EQ(ask(create(stored)).error, bad);
  EXPECT_EQ(ask(create_in_image(0x2200, od::DataType::unsigned8, 0x1000)).error, bad)
      << "beyond the image";
  OwnObject short_value = object(0x2200, 0, od::DataType::unsigned16);
  short_value.variable.value.pop_back();
  EXPECT_EQ(ask(create(short_value)).error, bad);
  EXPECT_EQ(read(0x2200, 0).error, to_error(AbortCode::no_object));
}

TEST_F(OwnObjectsTest, TheDictionaryCanBeListed) {
  run(config_with_objects());
  LocalRead list{.what = ObjectRange{0x2100, 0x2100}};
  const auto listed = std::get<std::vector<ListedObject>>(ask({.request = list}).data);
  ASSERT_EQ(listed.size(), 3U);
  EXPECT_EQ(listed[0].name, "Highest sub-index supported");
  EXPECT_EQ(listed[0].value, bytes_le(2, 1));
  const ListedObject recipe{.address = {0x2100, 1},
                            .type = od::DataType::unsigned16,
                            .access = od::Access::rww,
                            .mappable = true,
                            .application = true,
                            .name = "Recipe",
                            .value = bytes_le(5, 2)};
  EXPECT_EQ(listed[1], recipe);
  list.what = ObjectRange{};
  const auto all = std::get<std::vector<ListedObject>>(ask({.request = list}).data);
  EXPECT_GT(all.size(), 40U) << "all of it";
}

TEST_F(OwnObjectsTest, TheDeviceFileOfANodeCanBeListed) {
  LineConfig config = config_with_objects();
  NodeConfig node{.id = 5, .name = "drive"};
  node.device.objects = {{.index = 0x2000,
                          .name = "Gain",
                          .variables = {{.name = "Gain",
                                         .type = od::DataType::unsigned8,
                                         .access = od::Access::rw,
                                         .value = {std::byte{7}}}}},
                         {.index = 0x2001, .name = "Other", .variables = {{.name = "Other"}}}};
  config.nodes = {node, {.id = 6}};
  run(std::move(config));
  LocalRead list{.node = 5, .what = ObjectRange{0x2000, 0x2000}};
  const auto listed = std::get<std::vector<ListedObject>>(ask({.request = list}).data);
  const ListedObject gain{.address = {0x2000, 0},
                          .type = od::DataType::unsigned8,
                          .access = od::Access::rw,
                          .name = "Gain",
                          .value = bytes_le(7, 1)};
  EXPECT_EQ(listed, std::vector{gain}) << "with the value of the file";
  list.node = 6;
  EXPECT_EQ(ask({.request = list}).error, to_error(Refusal::bad_request))
      << "it has no device file";
  list.node = 7;
  EXPECT_EQ(ask({.request = list}).error, to_error(Refusal::bad_request)) << "it is not configured";
}

TEST_F(OwnObjectsTest, AnObserverHasNone) {
  LineConfig config = config_with_objects();
  config.role = Role::observer;
  make(config);
  EXPECT_EQ(line_->layout(Direction::inputs).entries.size(), 2U);
  EXPECT_THAT(line_->config().own_objects, IsEmpty());
}

TEST_F(OwnObjectsTest, WritesOfOthersAreEventsWhereTheImageDoesNotShowThem) {
  run(config_with_objects());
  const auto written = [&] {
    std::vector<Event> all = events();
    std::erase_if(all, [](const Event& e) { return e.kind() != EventKind::object_written; });
    return all;
  };
  hear(0x67F, {0x2F, 0x00, 0x21, 0x02, 'x', 0, 0, 0});
  const std::vector<Event> one = written();
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].time, now_);
  EXPECT_EQ(one[0].data, EventData(event::ObjectWritten{
                             .size = 1, .index = 0x2100, .sub = 2, .data = {std::byte{'x'}}}));
  hear(0x67F, {0x2B, 0x00, 0x21, 0x01, 7, 0, 0, 0});
  EXPECT_THAT(written(), IsEmpty()) << "the image shows it";
  EXPECT_TRUE(write(0x2100, 2, {std::byte{'y'}}).ok());
  EXPECT_THAT(written(), IsEmpty()) << "written by a command";
}

}  // namespace
}  // namespace linegate::line
