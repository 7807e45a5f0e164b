// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/model.h"

#include <gtest/gtest.h>

#include "bridges/console/json_text.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

const LineId kPressId{"plant", "press"};

LineView line_view(std::uint16_t network) {
  LineView view{.interface_uri = "virtual:press", .bit_rate = 500'000, .access = "all"};
  view.state.network_id = network;
  return view;
}

image::Layout layout() {
  image::Layout out{.direction = image::Direction::inputs, .id = 9, .byte_size = 4};
  out.entries.push_back({.bit_offset = 3,
                         .bit_length = 2,
                         .type = od::DataType::unsigned8,
                         .node = 5,
                         .index = 0x6000,
                         .sub = 1,
                         .name = "io.Bits"});
  out.entries.push_back({.bit_offset = 16,
                         .bit_length = 16,
                         .type = od::DataType::integer16,
                         .node = 5,
                         .index = 0x6401,
                         .sub = 1,
                         .name = "io.Analogue"});
  return out;
}

image::Snapshot snapshot(std::uint64_t layout_id) {
  image::Snapshot out{.layout_id = layout_id, .sequence = 4};
  out.bytes = {std::byte{0b0001'0000}, std::byte{0}, std::byte{0xFE}, std::byte{0xFF}};
  out.changed = {0b01};
  out.valid = {0b10};
  return out;
}

TEST(Model, ValuesNeedLayoutAndImageThatBelongTogether) {
  Model model;
  model.on_image(kPressId, snapshot(9));
  const Area& area = model.lines().at(kPressId).areas[0];
  EXPECT_TRUE(area.value(0).empty());
  model.on_layout(kPressId, layout());
  EXPECT_EQ(area.value(0), std::vector<std::byte>{std::byte{2}}) << "bits 3 and 4";
  EXPECT_EQ(area.value(1), (std::vector<std::byte>{std::byte{0xFE}, std::byte{0xFF}}));
  EXPECT_FALSE(area.valid(0));
  EXPECT_TRUE(area.valid(1));
  model.on_image(kPressId, snapshot(10));
  EXPECT_FALSE(area.complete());
}

TEST(Model, AnImageThatIsTooShortForItsLayoutHasNoValues) {
  Model model;
  model.on_layout(kPressId, layout());
  image::Snapshot image = snapshot(9);
  image.valid.clear();
  model.on_image(kPressId, image);
  const Area& area = model.lines().at(kPressId).areas[0];
  EXPECT_FALSE(area.complete());
  EXPECT_FALSE(area.valid(1));
  EXPECT_TRUE(area.value(1).empty());
  image = snapshot(9);
  image.changed.clear();
  model.on_image(kPressId, image);
  EXPECT_FALSE(area.complete());
}

// As after a reload by which two inputs exchange their names: the ID remains.
TEST(Model, AnImageFromBeforeARestartIsNotReadThroughOtherNames) {
  const Instant begin{std::chrono::seconds(1000)};
  Model model;
  model.at(begin);
  model.on_layout(kPressId, layout());
  model.on_image(kPressId, snapshot(9));
  const Area& area = model.lines().at(kPressId).areas[0];
  EXPECT_TRUE(area.valid(1));
  image::Layout other = layout();
  other.entries[1].name = "io.Level";
  model.on_layout(kPressId, other);
  EXPECT_FALSE(area.valid(1));
  EXPECT_TRUE(area.value(1).empty());
  model.at(begin + std::chrono::milliseconds(100));
  image::Snapshot first = snapshot(9);
  first.sequence = 1;
  model.on_image(kPressId, first);
  EXPECT_FALSE(area.valid(1));
  model.at(begin + std::chrono::milliseconds(1'100));
  EXPECT_TRUE(area.valid(1)) << "nothing has changed since";
}

TEST(Model, NodesAndGroupsOfAnEarlierIncarnationAreGone) {
  Model model;
  LineView view = line_view(3);
  view.incarnation = 1;
  model.on_line(kPressId, view);
  model.on_node(kPressId, {.state = {.node = 5}, .incarnation = 1});
  model.on_node(kPressId, {.state = {.node = 7}, .incarnation = 1});
  model.on_output_state(kPressId, {.state = {.group = 2}, .incarnation = 1});
  const Line& line = model.lines().at(kPressId);
  model.on_line(kPressId, view);
  EXPECT_EQ(line.nodes.size(), 2U);
  EXPECT_EQ(line.groups.size(), 1U);
  model.on_node(kPressId, {.state = {.node = 5}, .incarnation = 2});  // before its LineState
  view.incarnation = 2;
  model.on_line(kPressId, view);
  EXPECT_EQ(line.nodes.size(), 2U) << "two gateways of one name publish by turns";
  model.at(Instant{} + Model::kSilence);
  model.on_line(kPressId, view);
  ASSERT_EQ(line.nodes.size(), 1U);
  EXPECT_TRUE(line.nodes.contains(5));
  EXPECT_TRUE(line.groups.empty());
}

TEST(Model, ALateStateOfAnEarlierIncarnationRemovesNothing) {
  Model model;
  LineView view = line_view(3);
  view.incarnation = 2;
  model.on_line(kPressId, view);
  model.on_node(kPressId, {.state = {.node = 5}, .incarnation = 2});
  model.at(Instant{} + Model::kSilence);
  view.incarnation = 1;
  model.on_line(kPressId, view);
  view.incarnation = 2;
  model.on_line(kPressId, view);
  EXPECT_TRUE(model.lines().at(kPressId).nodes.contains(5));
}

// Each of them publishes its LineState every second, and a NodeState only when it changes.
TEST(Model, OfTwoGatewaysWithOneNameAllNodesRemain) {
  Model model;
  LineView view = line_view(3);
  view.properties = {{"namesakes", "1"}};
  view.incarnation = 1;
  model.on_line(kPressId, view);
  model.on_node(kPressId, {.state = {.node = 5}, .incarnation = 1});
  view.incarnation = 2;
  model.on_line(kPressId, view);
  EXPECT_TRUE(model.lines().at(kPressId).nodes.contains(5));
}

TEST(Model, ANodeOrGroupThatItsGatewayRemovedIsGone) {
  Model model;
  model.on_line(kPressId, line_view(3));
  model.on_node(kPressId, {.state = {.node = 5}});
  model.on_node(kPressId, {.state = {.node = 7}});
  model.on_output_state(kPressId, {.state = {.group = 2}});
  const Line& line = model.lines().at(kPressId);
  const std::uint64_t before = model.revision();
  model.on_node_gone(kPressId, 7);
  EXPECT_GT(model.revision(), before) << "the monitor draws again";
  EXPECT_EQ(line.nodes.size(), 1U);
  EXPECT_TRUE(line.nodes.contains(5));
  model.on_output_state_gone(kPressId, 2);
  EXPECT_TRUE(line.groups.empty());
  model.on_node_gone({"plant", "never received"}, 5);
  EXPECT_EQ(model.lines().size(), 1U);
}

TEST(Model, IsBoundedWhateverNamesStrangersPublish) {
  Model model;
  for (std::size_t i = 0; i < Model::kMaxLines + 10; ++i) {
    model.on_line({"stranger", std::to_string(i)}, line_view(1));
  }
  const LineId beyond{"stranger", "one more"};
  model.on_event(beyond, {});
  model.on_image(beyond, snapshot(9));
  EXPECT_EQ(model.lines().size(), Model::kMaxLines);
  EXPECT_EQ(model.left_out(), 12U);
  EXPECT_EQ(model.events_seen(), 0U);
  model.on_event({"stranger", "7"}, {});
  EXPECT_EQ(model.events_seen(), 1U) << "known lines are still processed";
  EXPECT_EQ(model.pop_warnings().size(), 1U);
  EXPECT_TRUE(model.pop_warnings().empty()) << "reported once";
  EXPECT_EQ(dropped_text(model), "   dropped, too many lines: 12");
}

TEST(Model, LinesAreFoundByNameAndByNetwork) {
  Model model;
  model.on_line(kPressId, line_view(3));
  model.on_line({"plant", "hall"}, line_view(4));
  ASSERT_EQ(model.find("3").size(), 1U);
  EXPECT_EQ(model.find("3").front()->id, kPressId);
  EXPECT_EQ(model.find("hall").size(), 1U);
  EXPECT_EQ(model.find("").size(), 2U);
  EXPECT_TRUE(model.find("5").empty());
}

TEST(Model, KeepsTheNewestEvents) {
  Model model;
  for (std::uint64_t i = 1; i <= Model::kKeptEvents + 10; ++i) {
    model.on_event(kPressId, {.number = i, .text = "x"});
  }
  EXPECT_EQ(model.events().size(), Model::kKeptEvents);
  EXPECT_EQ(model.events().front().view.number, 11U);
  EXPECT_EQ(model.events_seen(), Model::kKeptEvents + 10);
}

TEST(Model, AGatewayWhoseNameAnotherHasIsToldOnce) {
  Model model;
  model.on_line(kPressId, line_view(3));
  EXPECT_TRUE(model.pop_warnings().empty());
  LineView view = line_view(3);
  view.properties = {{"outputs-access", "all"}, {"namesakes", "1"}};
  model.on_line(kPressId, view);
  model.on_line({"plant", "hall"}, view);
  const std::vector<std::string> told{
      "more than one gateway is called 'plant': values of all of them are mixed, and all execute "
      "commands"};
  EXPECT_EQ(model.pop_warnings(), told);
  model.on_line(kPressId, view);
  EXPECT_TRUE(model.pop_warnings().empty());
}

TEST(Tables, ShowValuesAndWhatIsMissing) {
  Model model;
  model.on_line(kPressId, line_view(3));
  const Line& line = model.lines().at(kPressId);
  EXPECT_EQ(image_table(line, image::Direction::inputs).front(), "press: no inputs received yet");
  model.on_layout(kPressId, layout());
  model.on_image(kPressId, snapshot(9));
  const Text text = image_table(line, image::Direction::inputs);
  ASSERT_EQ(text.size(), 3U);
  EXPECT_NE(text[1].find("(invalid)"), std::string::npos);
  EXPECT_NE(text[2].find("-2"), std::string::npos);
  EXPECT_NE(text[2].find("io.Analogue"), std::string::npos);
}

TEST(Tables, TimesAreUtc) {
  EXPECT_EQ(date_text(Instant{std::chrono::nanoseconds(1'767'225'600'123'456'789)}),
            "2026-01-01T00:00:00.123Z");
  EXPECT_EQ(clock_text(Instant{}), "-");
}

TEST(Json, BytesThatAreNoUtf8DoNotEndTheProgram) {
  Model model;
  model.on_node(kPressId, {.name = "\xFF\xFEname", .state = {.node = 5}});
  EXPECT_NE(nodes_json(model.find("")).find("\"node\":5"), std::string::npos);
}

}  // namespace
}  // namespace linegate::console
