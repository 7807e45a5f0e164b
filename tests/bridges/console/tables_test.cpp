// SPDX-License-Identifier: Apache-2.0
// Tables, filters, and fitting to a width, without a terminal.
#include "bridges/console/tables.h"

#include <chrono>
#include <limits>
#include <span>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/json_text.h"

#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

constexpr Duration kSecond = std::chrono::seconds(1);

std::vector<std::string> column(const Table& table, std::size_t at) {
  std::vector<std::string> out;
  for (const Row& row : table.rows) {
    out.push_back(row.cells.at(at).text);
  }
  return out;
}

Table small_table() {
  Table out{{{"NAME", false, true}, {"VALUE", true}}, {}, {}};
  out.rows.push_back({{}, {{"inlet valve, left of the door", {}}, {"10", 10.0}}});
  out.rows.push_back({{}, {{"b", {}}, {"9", 9.0}}});
  out.rows.push_back({{}, {{"c", {}}, {"none", {}}}});
  return out;
}

TEST(Table, NumbersAreSortedAsNumbersAndAheadOfTexts) {
  Table table = small_table();
  sort(table, 1, false);
  EXPECT_THAT(column(table, 1), ElementsAre("9", "10", "none"));
  sort(table, 1, true);
  EXPECT_THAT(column(table, 1), ElementsAre("10", "9", "none"));
  sort(table, 0, true);
  EXPECT_THAT(column(table, 0), ElementsAre("inlet valve, left of the door", "c", "b"));
  sort(table, 7, false);
  EXPECT_THAT(table.rows, SizeIs(3)) << "no such column: the order is unchanged";
}

TEST(Table, FlexibleColumnsGiveWayAndTheRestIsCut) {
  const Table table = small_table();
  EXPECT_THAT(
      fit(table, 0, 0),
      ElementsAre("NAME                           VALUE", "inlet valve, left of the door     10",
                  "b                                  9", "c                               none"));
  EXPECT_THAT(fit(table, 24, 0),
              ElementsAre("NAME               VALUE", "inlet val~the door    10",
                          "b                      9", "c                   none"));
  EXPECT_THAT(fit(table, 8, 0), ElementsAre("NAME    ", "inlet v~", "b       ", "c       "));
  EXPECT_THAT(fit(table, 8, 12), ElementsAre("   VALUE", "or    10", "       9", "    none"));
  EXPECT_THAT(fit({}, 80, 0), ElementsAre(""));
  Table with_extra = table;
  with_extra.columns[1].extra = true;
  EXPECT_EQ(fit(with_extra, 20, 0)[1], "inlet valv~ the door")
      << "no other column is narrowed for it";
}

TEST(Table, EveryWordIsInSomeCell) {
  Table table = small_table();
  keep_matches(table, {"DOOR", "10"});
  EXPECT_THAT(column(table, 1), ElementsAre("10"));
  keep_matches(table, {"no such thing"});
  EXPECT_TRUE(table.rows.empty());
}

TEST(Printable, NothingOfAStrangerSteersATerminal) {
  EXPECT_EQ(printable("drive \x1b[2J\r\n\x7f"), "drive ?[2J???");
  EXPECT_EQ(printable("Temperatur [\xC2\xB0"
                      "C] \xC3\xA4\xCF\x80"),
            "Temperatur [\xC2\xB0"
            "C] \xC3\xA4\xCF\x80");
  EXPECT_EQ(printable("\xC3(\xE4\xBD\xA0\xCC\x81\xFF\xC0\x80\xE2"),
            "?(??"
            "????")
      << "damaged, wide and combining characters";
  EXPECT_EQ(printable("\xC2\x9B"), "?") << "a C1 control character";
  EXPECT_EQ(width_of("\xC2\xB0"
                     "C"),
            2U);
  EXPECT_EQ(cut("\xC3\xA4\xC3\xB6\xC3\xBC", 1, 1), "\xC3\xB6");
  EXPECT_EQ(shorten("\xC3\xA4\xC3\xB6\xC3\xBC", 2), "\xC3\xA4~");
  EXPECT_EQ(shorten("abc", 0), "");
}

TEST(FilterText, IsReadAndWritten) {
  const auto filter = parse_filter("  line=press node=5  Temp  ");
  ASSERT_TRUE(filter);
  EXPECT_EQ(*filter, (Filter{.line = "press", .node = 5, .words = {"Temp"}}));
  EXPECT_EQ(text_of(*filter), "line=press node=5 Temp");
  EXPECT_TRUE(parse_filter("")->empty());
  EXPECT_FALSE(parse_filter("node=0"));
  EXPECT_FALSE(parse_filter("node=128"));
  EXPECT_FALSE(parse_filter("node=five"));
}

TEST(Tables, AFilterChoosesLinesNodesAndRows) {
  const Model model = test::plant();
  EXPECT_THAT(column(lines_of(model, {}), 0), ElementsAre("hall", "press"));
  EXPECT_THAT(column(lines_of(model, {.line = "3"}), 0), ElementsAre("press")) << "by network-ID";
  EXPECT_THAT(column(nodes_of(model, {}), 2), ElementsAre("climate", "ram", "(not configured)"));
  EXPECT_THAT(column(nodes_of(model, {.node = 5}), 2), ElementsAre("ram"));
  EXPECT_THAT(column(nodes_of(model, {.words = {"pre-operational"}}), 1), ElementsAre("9"));
  EXPECT_THAT(column(values_of(model, {}, Directions::both), 3),
              ElementsAre("climate.Temperature [\xC2\xB0"
                          "C]",
                          "ram.Position [mm]", "ram.Torque", "ram.Controlword"));
  EXPECT_THAT(column(values_of(model, {.node = 5}, Directions::outputs), 3),
              ElementsAre("ram.Controlword"));
  EXPECT_THAT(column(values_of(model, {.line = "nowhere"}, Directions::both), 3), ElementsAre());
  EXPECT_THAT(column(events_of(model, {.line = "press"}), 4), ElementsAre("second", "first"));
  EXPECT_THAT(column(events_of(model, {.node = 5}), 4), ElementsAre("second"));
  EXPECT_THAT(column(events_of(model, {}, 1), 4), ElementsAre("second")) << "the newest event";
}

// As of a udp: line.
TEST(Tables, ALineWithoutABitRateShowsNoLoad) {
  Model model;
  LineView view = test::line_view(3);
  model.on_line(test::kPress, view);
  EXPECT_THAT(column(lines_of(model, {}), 3), ElementsAre("12.3%"));
  view.bit_rate = 0;
  model.on_line(test::kPress, view);
  EXPECT_THAT(column(lines_of(model, {}), 3), ElementsAre("-"));
}

TEST(Tables, ANodeIdByLssStandsBehindTheNameOfItsDevice) {
  Model model;
  NodeView view{.name = "ram", .state = {.node = 5}};
  const auto name_with = [&](const std::string& id) {
    view.properties = {{"node-id", id}};
    model.on_node(test::kPress, view);
    return column(nodes_of(model, {}), 2);
  };
  EXPECT_THAT(name_with("5"), ElementsAre("ram"));
  EXPECT_THAT(name_with("9"), ElementsAre("ram (node-ID 9)"));
  EXPECT_THAT(name_with("none"), ElementsAre("ram (no node-ID)"));
}

TEST(Tables, ValuesHaveTypeUnitAndAge) {
  const Table table = values_of(test::plant(), {.line = "press"}, Directions::inputs);
  EXPECT_THAT(column(table, 4), ElementsAre("-200", "(invalid)"));
  EXPECT_THAT(column(table, 5), ElementsAre("mm", ""));
  EXPECT_THAT(column(table, 6), ElementsAre("INTEGER16", "REAL32"));
  EXPECT_THAT(column(table, 7), ElementsAre("0.2s", "-")) << "the second entry was never received";
  EXPECT_EQ(table.rows[0].style, Style::changed);
  EXPECT_EQ(table.rows[1].style, Style::warning);
}

TEST(Tables, AnOutputShowsWhetherItWasSentOrWhatItWaitsFor) {
  Model model = test::plant();
  const auto states = [&] {
    return column(values_of(model, {.line = "press", .node = 5}, Directions::both), kOutputState);
  };
  EXPECT_THAT(states(), ElementsAre("", "", "sent"));
  image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 10};
  image.bytes = {std::byte{0x0F}, std::byte{0}};
  image.changed = image.valid = {0};
  image.known = {1};
  model.on_image(test::kPress, image);
  EXPECT_THAT(states(), ElementsAre("", "", "waits for own node, which is initialising"));
  image.known = {0};
  model.on_image(test::kPress, image);
  EXPECT_THAT(states(), ElementsAre("", "", "never written"));
}

// The output of node 5 is known and not valid.
void receive_known_output(Model& model) {
  image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 10};
  image.bytes = {std::byte{0x0F}, std::byte{0}};
  image.changed = image.valid = {0};
  image.known = {1};
  model.on_image(test::kPress, image);
}

// Its state when the gateway reports that reason.
std::string state_that_waits(Model& model, line::OutputWait reason) {
  OutputStateView view;
  view.state.waiting = 1;
  view.state.waits = {{0, reason}};
  model.on_output_state(test::kPress, view);
  return column(values_of(model, {.line = "press", .node = 5}, Directions::both), kOutputState)
      .back();
}

TEST(Tables, AnOutputShowsTheReasonThatTheGatewayReports) {
  Model model = test::plant();
  LineView line = test::line_view(3);
  line.state.own_state = nmt::State::operational;
  model.on_line(test::kPress, line);
  receive_known_output(model);
  const auto state = [&](line::OutputWait reason) { return state_that_waits(model, reason); };
  EXPECT_EQ(state(line::OutputWait::trigger), "waits for a trigger of its PDO");
  EXPECT_EQ(state(line::OutputWait::update_time), "waits for the update time of its PDO");
  EXPECT_EQ(state(line::OutputWait::bus), "waits for the bus: no acknowledge");
  EXPECT_EQ(state(line::OutputWait::turn), "waits for its turn on the bus (SYNC, inhibit time)");
  EXPECT_EQ(state(line::OutputWait::node),
            "waits for node 5, which is not confirmed as operational yet");
  NodeView node{.name = "ram",
                .state = {.node = 5,
                          .state = nmt::State::operational,
                          .presence = line::Presence::present,
                          .boot = 'J'}};
  model.on_node(test::kPress, node);
  EXPECT_EQ(state(line::OutputWait::node),
            "waits for node 5, whose PDOs are not those of the image (boot status J)");
  EXPECT_EQ(state(line::OutputWait::own_node), "not sent, reason not reported")
      << "the own node is operational now";
}

TEST(Tables, AnOutputWithoutAReportedReasonShowsNone) {
  Model model = test::plant();
  LineView line = test::line_view(3);
  line.state.own_state = nmt::State::operational;
  model.on_line(test::kPress, line);
  receive_known_output(model);
  const auto state = [&] {
    return column(values_of(model, {.line = "press", .node = 5}, Directions::both), kOutputState)
        .back();
  };
  EXPECT_EQ(state(), "not sent, reason not reported") << "it is in no group";
  OutputStateView others;
  others.state.waiting = 65;
  others.state.waits = {{1, line::OutputWait::bus}};
  model.on_output_state(test::kPress, others);
  EXPECT_EQ(state(), "not sent, reason not reported") << "not among those that are reported";
}

// No PDO of the line carries it: it is an object of the own node.
TEST(Tables, AnOutputOfTheOwnNodeWaitsForNoOtherValue) {
  Model model = test::plant();
  LineView line = test::line_view(3);
  line.state.own_state = nmt::State::operational;
  model.on_line(test::kPress, line);
  image::Layout layout = *model.find("press").front()->areas[1].layout;
  layout.id = 12;
  layout.byte_size = 4;
  layout.entries.back().local_pdo = layout.entries.back().remote_pdo = 0;
  layout.entries.push_back(layout.entries.back());
  layout.entries.back().bit_offset += 16;
  layout.entries.back().name = "own.Other";
  model.on_layout(test::kPress, layout);
  const auto states = [&](unsigned char valid) {
    image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 12};
    image.bytes.resize(4);
    image.changed = {0};
    image.valid = {valid};
    image.known = {1};
    model.on_image(test::kPress, image);
    return column(values_of(model, {.line = "press", .node = 5}, Directions::both), kOutputState);
  };
  EXPECT_THAT(states(0), testing::Contains("not sent, reason not reported"));
  EXPECT_THAT(states(0), testing::Contains("never written"));
  EXPECT_THAT(states(1), testing::Contains("written"));
  line.state.own_state = nmt::State::stopped;
  model.on_line(test::kPress, line);
  EXPECT_THAT(states(0), testing::Contains("waits for own node, which is stopped"));
}

// The own state of the line is that of the device with the lowest node-ID.
TEST(Tables, AnOutputOfOneOfSeveralDevicesWaitsForItsDevice) {
  Model model = test::plant();
  LineView line = test::line_view(3);
  line.state.role = line::Role::device;
  line.state.own_state = nmt::State::stopped;
  model.on_line(test::kPress, line);
  NodeView node{
      .name = "ram",
      .state = {.node = 5, .state = nmt::State::operational, .presence = line::Presence::present}};
  model.on_node(test::kPress, node);
  receive_known_output(model);
  const auto state = [&](line::OutputWait reason) { return state_that_waits(model, reason); };
  EXPECT_EQ(state(line::OutputWait::turn), "waits for its turn on the bus (SYNC, inhibit time)");
  EXPECT_EQ(state(line::OutputWait::own_node), "waits for node 5 to be operational");
  node.state.state = nmt::State::stopped;
  model.on_node(test::kPress, node);
  EXPECT_EQ(state(line::OutputWait::own_node), "waits for node 5, which is stopped");
}

TEST(Tables, AnOutputOfAnotherMasterIsHeardOrNot) {
  Model model = test::plant();
  LineView line = test::line_view(3);
  line.state.role = line::Role::observer;
  model.on_line(test::kPress, line);
  image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 10};
  image.bytes = {std::byte{0x0F}, std::byte{0}};
  image.changed = image.valid = image.known = {0};
  model.on_image(test::kPress, image);
  EXPECT_EQ(
      column(values_of(model, {.line = "press", .node = 5}, Directions::both), kOutputState).back(),
      "not heard since its node's start");
}

TEST(Tables, WhatIsStaleIsShownAsSuch) {
  Model model = test::plant();
  EXPECT_TRUE(values_of(model, {}, Directions::inputs).notes.empty());
  model.at(Instant(10 * kSecond));
  const Table silent = values_of(model, {.line = "press"}, Directions::inputs);
  ASSERT_THAT(silent.notes, SizeIs(1));
  EXPECT_EQ(silent.notes[0].text,
            "press: nothing received for 10s; the last received values are shown");
  EXPECT_EQ(silent.rows[0].style, Style::stale);
  EXPECT_THAT(column(lines_of(model, {.line = "press"}), 2), ElementsAre("silent 10s"));
  model.on_line_gone(test::kPress);
  EXPECT_THAT(nodes_of(model, {.line = "press"}).notes[0].text, HasSubstr("the gateway is gone"));
  EXPECT_EQ(nodes_of(model, {.line = "press"}).rows[0].style, Style::stale);
  EXPECT_THAT(column(lines_of(model, {.line = "press"}), 2), ElementsAre("gateway gone"));
}

TEST(Tables, WhatDidNotComeYetIsSaid) {
  Model model;
  model.on_node(test::kPress, {.name = "ram", .state = {.node = 5}});
  EXPECT_THAT(column(lines_of(model, {}), 2), ElementsAre("(no state yet)"));
  Table values = values_of(model, {}, Directions::inputs);
  ASSERT_THAT(values.notes, SizeIs(1));
  EXPECT_EQ(values.notes[0].text, "press: no layout of the inputs received yet");
  image::Layout layout = test::inputs();
  model.on_layout(test::kPress, layout);
  EXPECT_EQ(values_of(model, {}, Directions::inputs).notes[0].text,
            "press: no values of the inputs received yet");
  model.on_image(test::kPress, test::input_image(layout.id + 1));
  EXPECT_EQ(values_of(model, {}, Directions::inputs).notes[0].text,
            "press: the layout of the inputs is not that of the values");
  layout.entries.clear();
  model.on_layout(test::kPress, layout);
  EXPECT_TRUE(values_of(model, {}, Directions::inputs).notes.empty()) << "there are no values";
}

TEST(Tables, RatesAreCountedOverASecondOrMore) {
  Model model;
  const auto state = [](Duration time, std::uint64_t frames) {
    LineView view = test::line_view(3);
    view.time = Instant(time);
    view.state.counters.frames_received = frames;
    return view;
  };
  model.on_line(test::kPress, state(10 * kSecond, 1000));
  EXPECT_THAT(column(lines_of(model, {}), 4), ElementsAre("-"));
  model.on_line(test::kPress, state(10 * kSecond + kSecond / 10, 1900));
  EXPECT_THAT(column(lines_of(model, {}), 4), ElementsAre("-")) << "too early for a rate";
  model.on_line(test::kPress, state(12 * kSecond, 2000));
  EXPECT_THAT(column(lines_of(model, {}), 4), ElementsAre("500"));
  model.on_line(test::kPress, state(13 * kSecond, 7));
  EXPECT_THAT(column(lines_of(model, {}), 4), ElementsAre("-")) << "the gateway was restarted";
}

TEST(Texts, DurationsAreAsExactAsPeopleWantThem) {
  EXPECT_EQ(duration_text(std::chrono::milliseconds(240)), "0.2s");
  EXPECT_EQ(duration_text(12 * kSecond), "12s");
  EXPECT_EQ(duration_text(150 * kSecond), "2min");
  EXPECT_EQ(duration_text(3 * 3600 * kSecond), "3h");
  EXPECT_EQ(duration_text(50 * 3600 * kSecond), "2d");
}

TEST(Json, ValuesAreNumbersWhereTheyAre) {
  Model model = test::plant();
  const std::string all = plant_json(model, {.line = "press"}, Instant(kSecond));
  EXPECT_THAT(
      all, HasSubstr(
               R"({"time":"1970-01-01T00:00:01.000Z","lines":[{"gateway":"plant","line":"press")"));
  EXPECT_THAT(all, HasSubstr(R"("unit":"mm","age_ms":200,"valid":true,"value":-200)"));
  EXPECT_THAT(all, HasSubstr(R"("unit":null,"age_ms":null,"valid":false,"value":null)"));
  EXPECT_THAT(all, HasSubstr(R"("freshness":"live")"));
  EXPECT_THAT(all, HasSubstr(R"("dropped":{"damaged":0,"left_out":0}})"));
  EXPECT_THAT(all, Not(HasSubstr("climate"))) << "an entry of another line";
  const std::string node = plant_json(model, {.node = 10}, Instant{});
  EXPECT_THAT(node, HasSubstr("climate"));
  EXPECT_THAT(node, Not(HasSubstr("Torque")));
}

// Pressure: raw 523, bar = raw * 0.1 - 40.
Model scaled_plant() {
  Model model;
  image::Layout layout{.direction = image::Direction::inputs, .id = 1, .byte_size = 2};
  layout.entries.push_back({.bit_length = 16,
                            .type = od::DataType::unsigned16,
                            .node = 5,
                            .name = "ram.Pressure",
                            .scaling = {.unit = "bar", .scale = 0.1, .offset = -40},
                            .low = 0,
                            .high = 250});
  image::Snapshot image{.layout_id = 1, .changed = {0}, .valid = {1}};
  image.bytes = {std::byte{0x0B}, std::byte{0x02}};
  model.on_layout(test::kPress, layout);
  model.on_image(test::kPress, image);
  return model;
}

// The table has "-" for their boot processes.
TEST(Json, OwnDevicesHaveNoBootProcess) {
  Model model = test::plant();
  const auto text_of_press = [&model] {
    const std::string json = nodes_json(model.find("press"));
    const std::size_t at = json.find("\"boot_text\":\"");
    return json.substr(at, json.find(',', at) - at);
  };
  EXPECT_THAT(text_of_press(), Not(testing::StrEq("\"boot_text\":\"\"")));
  LineView view = test::line_view(3);
  view.state.role = line::Role::device;
  model.on_line(test::kPress, view);
  EXPECT_EQ(text_of_press(), "\"boot_text\":\"\"");
}

TEST(Tables, AFlyingMasterNamesTheActiveOne) {
  constexpr std::size_t kRole = 10;
  Model model = test::plant();
  LineView view = test::line_view(3);
  view.state.role = line::Role::device;
  view.state.flying_master = nmt::FlyingMasterState::slave;
  view.state.active_master = 9;
  model.on_line(test::kPress, view);
  EXPECT_THAT(column(lines_of(model, {}), kRole), testing::Contains("flying slave of 9"));
  view.state.flying_master = nmt::FlyingMasterState::negotiate;
  view.state.active_master = 0;
  model.on_line(test::kPress, view);
  EXPECT_THAT(column(lines_of(model, {}), kRole), testing::Contains("flying negotiate"));
}

TEST(Json, AScaledValueIsInItsUnitBesideTheRawOne) {
  EXPECT_THAT(
      image_json(scaled_plant().lines().at(test::kPress), image::Direction::inputs),
      HasSubstr(R"("unit":"bar","age_ms":null,"valid":true,"value":12.3,"bytes":"0B02","raw":523,)"
                R"("scale":0.1,"offset":-40.0,"low":0.0,"high":250.0})"));
}

TEST(Tables, AScaledValueIsInItsUnit) {
  const Model model = scaled_plant();
  const Text text = image_table(model.lines().at(test::kPress), image::Direction::inputs);
  ASSERT_EQ(text.size(), 2U);
  EXPECT_THAT(text[1], HasSubstr(" 12.3 bar "));
  EXPECT_THAT(text[1], HasSubstr("0B 02"));
  const Table values = values_of(model, {}, Directions::inputs);
  ASSERT_EQ(values.rows.size(), 1U);
  EXPECT_EQ(values.rows[0].cells[4].text, "12.3");
  EXPECT_EQ(values.rows[0].cells[4].number, 12.3);
  EXPECT_EQ(values.rows[0].cells[5].text, "bar");
}

TEST(Json, RealsThatAreNoNumberAreWords) {
  Model model;
  image::Layout layout{.direction = image::Direction::inputs, .id = 1, .byte_size = 16};
  image::Snapshot image{.layout_id = 1, .changed = {0}, .valid = {15}};
  for (const float value : {std::numeric_limits<float>::quiet_NaN(),
                            -std::numeric_limits<float>::infinity(), 1.5F, 0.1F}) {
    layout.entries.push_back({.bit_offset = static_cast<std::uint32_t>(8 * image.bytes.size()),
                              .bit_length = 32,
                              .type = od::DataType::real32});
    const auto bytes = std::as_bytes(std::span(&value, 1));
    image.bytes.insert(image.bytes.end(), bytes.begin(), bytes.end());
  }
  model.on_layout(test::kPress, layout);
  model.on_image(test::kPress, image);
  const std::string text =
      stream_image_json(model.lines().at(test::kPress), image::Direction::inputs, 0);
  EXPECT_EQ(text.find(R"({"type":"image","gateway":"plant","line":"press","direction":"inputs")"),
            0U);
  EXPECT_THAT(text, HasSubstr(R"("value":"nan")"));
  image.marks.push_back(
      {.local_pdo = 3, .remote_pdo = 1, .node = 5, .count = 2, .time = Instant{kSecond}});
  model.on_image(test::kPress, image);
  EXPECT_THAT(
      image_json(model.lines().at(test::kPress), image::Direction::inputs),
      HasSubstr(R"("pdos":[{"local_pdo":3,"node":5,"remote_pdo":1,"count":2,"time":"1970)"));
  EXPECT_THAT(text, HasSubstr(R"("value":"-inf")"));
  EXPECT_THAT(text, HasSubstr(R"("value":1.5)"));
  EXPECT_THAT(text, testing::ContainsRegex(R"("value":0\.1[,}])"));  // the digits of a REAL32
}

}  // namespace
}  // namespace linegate::console
