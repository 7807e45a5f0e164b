// SPDX-License-Identifier: Apache-2.0
// The pages and keys of the monitor, on a grid of cells, without a terminal.
#include "bridges/console/monitor_view.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/monitor_pages.h"

#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class MonitorTest : public testing::Test {
 protected:
  void press(std::string_view characters) {
    for (const char c : characters) {
      EXPECT_TRUE(view_.handle({Key::character, static_cast<char32_t>(c)}, model_));
      draw();
    }
  }
  void press(Key key) {
    EXPECT_TRUE(view_.handle({key}, model_));
    draw();
  }
  void draw(std::size_t rows = 24, std::size_t columns = 80) {
    canvas_ = view_.draw(model_, rows, columns, Instant{std::chrono::seconds(3723)});
  }
  std::string row(std::size_t at) const { return canvas_.text(at); }
  std::string all() const {
    std::string out;
    for (std::size_t i = 0; i < canvas_.rows(); ++i) {
      out += row(i) + '\n';
    }
    return out;
  }
  // The row at the cursor.
  std::string chosen() const {
    for (std::size_t i = 0; i < canvas_.rows(); ++i) {
      if (row(i).starts_with('>')) {
        return row(i);
      }
    }
    return "none";
  }
  // The style of the first cell of this text on the screen.
  Style style_of_text(const std::string& text) const {
    for (std::size_t i = 0; i < canvas_.rows(); ++i) {
      if (const std::size_t at = row(i).find(text); at != std::string::npos) {
        return canvas_.at(i, at).style;
      }
    }
    ADD_FAILURE() << text << " is not on the screen";
    return Style::plain;
  }

  Model model_ = test::plant();
  MonitorView view_;
  Canvas canvas_{0, 0};
};

TEST_F(MonitorTest, BeginsWithTheLinesAndTheNewestEvents) {
  draw();
  EXPECT_EQ(row(0),
            " linegate   1 Lines  2 Nodes  3 Values  4 Events  ? keys           01:02:03 UTC");
  EXPECT_EQ(row(1), " 2 lines, 2 of 2 nodes operational");
  EXPECT_THAT(row(2), AllOf(StartsWith(" LINE  NET BUS"), HasSubstr("LOAD"), HasSubstr("NODES")));
  EXPECT_THAT(row(3), AllOf(StartsWith(">hall    4 error-active"), HasSubstr("12.3%")));
  EXPECT_THAT(row(4), StartsWith(" press   3 error-active"));
  EXPECT_EQ(row(6), " the newest events");
  EXPECT_THAT(row(7), AllOf(HasSubstr("heartbeat-lost"), HasSubstr("second")));
  EXPECT_THAT(row(8), HasSubstr("first"));
  EXPECT_THAT(row(23), StartsWith(" q quit  ? keys"));
}

// Own devices and the nodes that an observer sees have no boot process.
TEST_F(MonitorTest, OnlyNodesOfAManagerHaveABootRow) {
  const auto has_boot = [this] {
    const std::vector<Note> page = node_page(model_, test::kPress, 5, 80);
    return std::ranges::any_of(page,
                               [](const Note& note) { return note.text.starts_with("boot "); });
  };
  EXPECT_TRUE(has_boot());
  for (const line::Role role : {line::Role::device, line::Role::observer}) {
    LineView view = test::line_view(3);
    view.state.role = role;
    model_.on_line(test::kPress, view);
    EXPECT_FALSE(has_boot());
  }
}

TEST_F(MonitorTest, WithoutAGatewayItSaysSo) {
  model_ = {};
  draw();
  EXPECT_EQ(row(1), " waiting for a gateway");
  EXPECT_EQ(row(3), " nothing yet");
  press("23s4?");
  press(Key::enter);
  press(Key::down);
}

TEST_F(MonitorTest, PagesByNumberAndByTab) {
  press("3");
  EXPECT_THAT(row(2),
              AllOf(HasSubstr("OBJECT"), HasSubstr("VALUE"), HasSubstr("UNIT"), HasSubstr("TYPE")));
  EXPECT_THAT(row(4),
              AllOf(HasSubstr("ram.Position"), HasSubstr(" -200 mm"), HasSubstr("INTEGER16")));
  EXPECT_EQ(style_of_text("ram.Position"), Style::changed);
  EXPECT_EQ(style_of_text("ram.Torque"), Style::warning) << "not valid";
  press(Key::tab);
  EXPECT_THAT(row(2), StartsWith(" TIME"));
  press(Key::tab);
  EXPECT_THAT(row(2), HasSubstr("MANAGER"));
  press(Key::back_tab);
  EXPECT_THAT(row(2), StartsWith(" TIME"));
  press("o");
  press("3");
  EXPECT_THAT(all(), AllOf(HasSubstr("   inputs"), Not(HasSubstr("Controlword"))));
}

TEST_F(MonitorTest, EnterGoesFromALineToItsNodesToOneNodeAndEscapeBack) {
  draw();
  press(Key::down);
  EXPECT_THAT(chosen(), StartsWith(">press"));
  press(Key::enter);
  EXPECT_EQ(view_.filter().line, "press");
  EXPECT_THAT(all(),
              AllOf(HasSubstr("only line=press"), HasSubstr("ram"), Not(HasSubstr("climate"))));
  EXPECT_EQ(style_of_text("(not configured)"), Style::warning);
  press(Key::enter);
  EXPECT_EQ(row(2), " node 5 of press (gateway plant): ram");
  EXPECT_THAT(all(), AllOf(HasSubstr("operational, present"), HasSubstr("vendor 00000319h"),
                           HasSubstr("2 EMCYs, the last: 8130h: heartbeat or life guarding error"),
                           HasSubstr("ram.Position [mm]"), HasSubstr("ram.Controlword"),
                           HasSubstr("heartbeat-lost  second"), Not(HasSubstr("line-started"))));
  press(Key::escape);
  EXPECT_THAT(row(2), StartsWith(" LINE  NODE NAME"));
  press(Key::escape);
  EXPECT_TRUE(view_.filter().empty());
  EXPECT_THAT(all(), HasSubstr("climate"));
}

TEST_F(MonitorTest, AnOutputThatWaitsIsShownWithItsReason) {
  image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 10};
  image.bytes = {std::byte{0x0F}, std::byte{0}};
  image.changed = image.valid = image.known = {0};
  model_.on_image(test::kPress, image);
  press("3oo");
  for (int i = 0; i < 6; ++i) {
    press(Key::right);
  }
  EXPECT_THAT(row(2), HasSubstr("STATE"));
  EXPECT_THAT(all(), HasSubstr("never written"));
  press(Key::enter);
  EXPECT_THAT(all(), HasSubstr(" 1 output: never written"));
}

TEST_F(MonitorTest, SortsByEachColumnInTurnAndTheOtherWayRound) {
  press("2");
  EXPECT_THAT(row(3), HasSubstr("climate")) << "in the order of the lines";
  press("sss");
  EXPECT_THAT(row(2), HasSubstr("NAME+"));
  EXPECT_THAT(row(3), HasSubstr("(not configured)"));
  press("r");
  EXPECT_THAT(row(2), HasSubstr("NAME-"));
  EXPECT_THAT(row(3), HasSubstr("ram"));
  press("S");
  EXPECT_THAT(row(2), HasSubstr("NODE-"));
  press("SS");
  EXPECT_THAT(row(2), Not(HasSubstr("-")));
}

TEST_F(MonitorTest, TheFilterIsTyped) {
  press("2/line=press x");
  EXPECT_EQ(row(23), " filter (line=, node=, words): line=press x_");
  press(Key::backspace);
  press(Key::backspace);
  press(" OPERATIONAL");
  press(Key::enter);
  EXPECT_EQ(view_.filter(), (Filter{.line = "press", .words = {"OPERATIONAL"}}));
  EXPECT_THAT(row(1), HasSubstr("only line=press OPERATIONAL"));
  press("/ node=500");
  press(Key::enter);
  EXPECT_EQ(row(23), " no node-ID from 1 to 127: line=press OPERATIONAL node=500");
  EXPECT_EQ(canvas_.at(23, 1).style, Style::error);
  press("/ zzz");
  press(Key::enter);
  EXPECT_EQ(row(3), " nothing that line=press OPERATIONAL zzz would show; Esc shows all");
  press("/q");
  press(Key::escape);
  EXPECT_EQ(view_.filter().words.size(), 2U) << "the filter is unchanged";
}

TEST_F(MonitorTest, LinesAndNodesAreChosenByOneKey) {
  press("2l");
  EXPECT_EQ(view_.filter().line, "hall");
  press("l");
  EXPECT_EQ(view_.filter().line, "press");
  press("n");
  EXPECT_EQ(view_.filter(), (Filter{.line = "press", .node = 5}));
  press("n");
  EXPECT_EQ(view_.filter().node, 0);
  press("l");
  EXPECT_TRUE(view_.filter().empty());
  model_.on_line({"other", "press"}, test::line_view(7));
  press("lll");
  EXPECT_EQ(view_.filter().line, "plant/press") << "two gateways have a line of that name";
}

TEST_F(MonitorTest, TheCursorStaysWithItsRowAndTheFirstRowWithTheNewest) {
  press("4");
  EXPECT_THAT(chosen(), HasSubstr("second"));
  model_.on_event(test::kPress, test::event(EventKind::boot_up, 3, 5, "third"));
  draw();
  EXPECT_THAT(chosen(), HasSubstr("third"));
  press(Key::down);
  EXPECT_THAT(chosen(), HasSubstr("second"));
  model_.on_event(test::kPress, test::event(EventKind::boot_up, 4, 5, "fourth"));
  draw();
  EXPECT_THAT(chosen(), HasSubstr("second"));
  press(Key::enter);
  EXPECT_EQ(row(2), " node 5 of press (gateway plant): ram");
}

TEST_F(MonitorTest, ALongListScrolls) {
  for (std::uint64_t i = 3; i <= 100; ++i) {
    model_.on_event(test::kPress,
                    test::event(EventKind::boot_up, i, 5, "number " + std::to_string(i)));
  }
  press("4");
  EXPECT_THAT(all(),
              AllOf(HasSubstr("number 100"), HasSubstr("number 81"), Not(HasSubstr("number 80"))));
  press(Key::page_down);
  EXPECT_THAT(chosen(), HasSubstr("number 81"));
  press(Key::down);
  EXPECT_THAT(all(), AllOf(HasSubstr("number 80"), Not(HasSubstr("number 100"))));
  press(Key::end);
  EXPECT_THAT(chosen(), HasSubstr("first"));
  EXPECT_EQ(row(22), chosen());
  press(Key::home);
  EXPECT_THAT(chosen(), HasSubstr("number 100"));
  press(Key::right);
  EXPECT_THAT(row(3), Not(HasSubstr("00:01:40"))) << "scrolled to the side";
}

TEST_F(MonitorTest, HoldsThePicture) {
  press("4p");
  model_.on_event(test::kPress, test::event(EventKind::boot_up, 3, 5, "third"));
  draw();
  EXPECT_THAT(all(), AllOf(HasSubstr("HELD"), Not(HasSubstr("third"))));
  press("p");
  EXPECT_THAT(all(), HasSubstr("third"));
}

TEST_F(MonitorTest, StaleAndGoneLinesAreMarkedOnEveryPage) {
  model_.at(Instant{std::chrono::seconds(7)});
  model_.on_line_gone(test::kHall);
  press("2");
  EXPECT_THAT(row(1), HasSubstr("2 not heard"));
  EXPECT_EQ(row(2), " hall: the gateway is gone; the last received values are shown");
  EXPECT_EQ(row(3), " press: nothing received for 7.0s; the last received values are shown");
  EXPECT_EQ(canvas_.at(2, 1).style, Style::error);
  EXPECT_EQ(style_of_text("ram"), Style::stale);
  press("3");
  EXPECT_EQ(style_of_text("ram.Position"), Style::stale);
}

TEST_F(MonitorTest, HelpNamesEveryKey) {
  press("?");
  EXPECT_EQ(row(2), " keys");
  for (const char* const key : {"1 2 3 4", "Tab", "PgUp", "Enter", "Esc", "s, S", "  r ", "  / ",
                                "  l ", "  n ", "  o ", "  p,", "?, h", "q, Ctrl-C"}) {
    EXPECT_THAT(all(), HasSubstr(key));
  }
  press(Key::end);
  EXPECT_THAT(all(), HasSubstr("silent or gone")) << "scrolling shows the remaining lines";
  press(Key::escape);
  EXPECT_THAT(row(2), StartsWith(" LINE"));
  EXPECT_FALSE(view_.handle({Key::character, U'q'}, model_));
}

TEST_F(MonitorTest, AnySizeHasItsPicture) {
  for (const std::size_t columns : {0U, 1U, 2U, 20U, 79U, 300U}) {
    for (const std::size_t rows : {0U, 1U, 2U, 3U, 4U, 5U, 24U, 100U}) {
      for (const std::string_view page : {"1", "2", "3", "4", "?"}) {
        press(page);
        draw(rows, columns);
        EXPECT_EQ(canvas_.rows(), rows);
        EXPECT_EQ(canvas_.columns(), columns);
        EXPECT_TRUE(view_.handle({Key::page_down}, model_));
        EXPECT_TRUE(view_.handle({Key::enter}, model_));
        draw(rows, columns);
      }
    }
  }
  press(Key::escape);
  press("1");
  draw(60, 200);
  EXPECT_THAT(row(2), AllOf(HasSubstr("INTERFACE"), HasSubstr("GATEWAY")));
  EXPECT_THAT(row(59), StartsWith(" q quit"));
}

TEST_F(MonitorTest, NamesOfStrangersCannotSteerTheTerminal) {
  model_.on_node(test::kPress, {.name = "\x1b[2J", .state = {.node = 66}});
  press("2");
  for (std::size_t i = 0; i < canvas_.rows(); ++i) {
    for (std::size_t j = 0; j < canvas_.columns(); ++j) {
      EXPECT_GE(canvas_.at(i, j).character, U' ');
    }
  }
  EXPECT_THAT(all(), HasSubstr("?[2J"));
}

}  // namespace
}  // namespace linegate::console
