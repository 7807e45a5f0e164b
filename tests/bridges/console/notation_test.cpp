// SPDX-License-Identifier: Apache-2.0
// The notation in which one command prints an object is accepted by all others.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "bridges/console/dictionary.h"
#include "bridges/console/lookup.h"
#include "bridges/console/tables.h"

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using test::as;

using testing::ElementsAre;
using testing::HasSubstr;

image::Layout sixteen_outputs() {
  image::Layout out{.direction = image::Direction::outputs, .id = 5, .byte_size = 16};
  for (std::uint8_t sub = 1; sub <= 16; ++sub) {
    out.entries.push_back({.bit_offset = 8U * (sub - 1U),
                           .bit_length = 8,
                           .type = od::DataType::unsigned8,
                           .node = 8,
                           .index = 0x6200,
                           .sub = sub,
                           .remote_pdo = 1,
                           .name = "panel.Output " + std::to_string(sub)});
  }
  return out;
}

image::Snapshot image_of_sixteen() {
  image::Snapshot out{.direction = image::Direction::outputs, .layout_id = 5, .sequence = 1};
  out.bytes.resize(16);
  out.changed = {0};
  out.valid = {0xFFFF};
  return out;
}

// One line with sixteen outputs of one device.
class Panel : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    listener.on_line(test::kPress, test::line_view(3));
    listener.on_layout(test::kPress, layout);
    listener.on_image(test::kPress, image_of_sixteen());
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    last = command;
    return {};
  }

  image::Layout layout = sixteen_outputs();
  line::Command last;
};

using Notation = test::CommandTest<Panel>;

// The texts in the column OBJECT of a table.
std::vector<std::string> objects_in(const Table& table) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < table.columns.size(); ++at) {
    for (const Row& row : table.rows) {
      if (table.columns[at].title == "OBJECT") {
        out.push_back(row.cells.at(at).text);
      }
    }
  }
  return out;
}

TEST_F(Notation, WhatTheMonitorAndTheImageShowIsWhatWriteAndSdoTake) {
  Model model;
  gateway_.poll({}, model);
  const std::vector<std::string> shown = objects_in(values_of(model, {}, Directions::outputs));
  ASSERT_EQ(shown.size(), 16U);
  EXPECT_EQ(shown[9], "6200:0A");
  ASSERT_EQ(image(context_, "press", image::Direction::outputs), kDone);
  for (std::uint8_t place = 0; place < 16; ++place) {
    const std::string& object = shown[place];
    EXPECT_THAT(out_.str(), HasSubstr(' ' + object + ' '));
    for (const std::string node : {"8.", "panel."}) {
      EXPECT_EQ(write(context_, "press", node + object, "1"), kDone) << err_.str();
      EXPECT_EQ(as<line::SingleOutput>(gateway_.last).entry, place) << node << object;
    }
    EXPECT_EQ(sdo_read(context_, "press:8", object, "", "u8"), kDone);
    EXPECT_EQ(as<line::SdoRead>(gateway_.last).address.sub, place + 1);
    EXPECT_EQ(sdo_write(context_, "press:8", object, "", "u8", "1"), kDone);
    EXPECT_EQ(as<line::SdoWrite>(gateway_.last).address.sub, place + 1);
  }
}

TEST_F(Notation, ASubIndexIsHexadecimalEverywhere) {
  EXPECT_EQ(write(context_, "press", "8.6200:10", "0x55"), kDone);
  EXPECT_EQ(as<line::SingleOutput>(gateway_.last).entry, 15U);
  EXPECT_EQ(sdo_read(context_, "press:8", "6200", "10", "u8"), kDone);
  EXPECT_EQ(as<line::SdoRead>(gateway_.last).address.sub, 16);
  EXPECT_EQ(sdo_read(context_, "press:8", "6200", "0a", "u8"), kDone);
  EXPECT_EQ(as<line::SdoRead>(gateway_.last).address.sub, 10);
  EXPECT_EQ(image_read(context_, "press:8", "6200:0B", "", "u8"), kDone);
  EXPECT_EQ(as<line::SdoRead>(gateway_.last).address.sub, 11);
  EXPECT_EQ(object_write(context_, "press:8", "6200", "10", "u8", "1", false), kDone);
  EXPECT_EQ(as<line::ObjectWrite>(gateway_.last).address.sub, 16);
  EXPECT_EQ(sdo_read(context_, "press:8", "6200:01", "1", "u8"), kUsage);
  EXPECT_EQ(sdo_read(context_, "press:8", "6200", "100", "u8"), kUsage);
}

TEST_F(Notation, AnObjectThatIsMappedTwiceIsRefusedWithBothEntries) {
  gateway_.layout.entries[15].sub = 10;
  gateway_.layout.entries[15].remote_pdo = 3;
  EXPECT_EQ(write(context_, "press", "panel.6200:0A", "1"), kUsage);
  EXPECT_EQ(err_.str(),
            "'panel.6200:0A' is ambiguous; give the number of one:\n"
            "  9: panel.Output 10, 6200:0A of node 8, its PDO 1\n"
            "  15: panel.Output 16, 6200:0A of node 8, its PDO 3\n");
  EXPECT_EQ(write(context_, "press", "15", "1"), kDone);
  gateway_.layout.entries[15].name = gateway_.layout.entries[9].name;
  EXPECT_EQ(write(context_, "press", "panel.Output 10", "1"), kUsage)
      << "a name that two outputs have is ambiguous";
}

TEST(ObjectWords, AreSplitByHowManyFollow) {
  const auto read = split_object({"6200:0A", "u8"}, 0, 1);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->sub, "");
  EXPECT_THAT(read->rest, ElementsAre("u8"));
  const auto apart = split_object({"6200", "A", "u8"}, 0, 1);
  ASSERT_TRUE(apart);
  EXPECT_EQ(apart->sub, "A");
  const auto variable = split_object({"1000", "u32"}, 0, 1);
  ASSERT_TRUE(variable);
  EXPECT_EQ(variable->sub, "");
  EXPECT_THAT(variable->rest, ElementsAre("u32"));
  const auto written = split_object({"6040", "u16", "15"}, 2, 2);
  ASSERT_TRUE(written);
  EXPECT_EQ(written->sub, "");
  EXPECT_THAT(written->rest, ElementsAre("u16", "15"));
  const auto four = split_object({"6040", "0", "u16", "15"}, 2, 2);
  ASSERT_TRUE(four);
  EXPECT_EQ(four->sub, "0");
  EXPECT_FALSE(split_object({"6040:00", "0", "u16", "15"}, 2, 2));
  EXPECT_FALSE(split_object({"6040"}, 2, 2));
  EXPECT_FALSE(split_object({}, 0, 1));
}

TEST(ObjectWords, ASubIndexThatIsADataTypeTooIsNotRead) {
  EXPECT_EQ(why_ambiguous({"1021", "d", "00FF"}),
            "'d' is a sub-index and a data type: write '1021:d 00FF' or '1021:00 d 00FF'");
  EXPECT_THAT(why_ambiguous({"2005", "B", "1"}), HasSubstr("'2005:B 1' or '2005:00 B 1'"));
  for (const std::vector<std::string>& words : {std::vector<std::string>{"2005", "0B", "1"},
                                                {"2005", "A", "1"},
                                                {"2005", "u8", "1"},
                                                {"2005:00", "b", "1"},
                                                {"2005", "b"},
                                                {"2005", "0", "b", "1"},
                                                {"2005", "b", "b", "1"}}) {
    EXPECT_EQ(why_ambiguous(words), "") << words[1];
  }
}

}  // namespace
}  // namespace linegate::console
