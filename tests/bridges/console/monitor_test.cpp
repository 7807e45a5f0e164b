// SPDX-License-Identifier: Apache-2.0
// The monitor as text: its output for one named node.
#include "bridges/console/monitor.h"

#include <string>

#include <gmock/gmock.h>

#include "bridges/console/lookup.h"

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Sends the samples of a gateway once: a DDS reader, too, receives layouts and kept events once.
class OnceSent : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    for (const auto& [name, gateway] : model.gateways()) {
      listener.on_gateway(name, gateway);
    }
    for (const auto& [id, line] : model.lines()) {
      line.view ? listener.on_line(id, *line.view) : void();
      for (const auto& [number, node] : line.nodes) {
        listener.on_node(id, node);
      }
      for (const Area& area : line.areas) {
        area.layout ? listener.on_layout(id, *area.layout) : void();
        area.image ? listener.on_image(id, *area.image) : void();
      }
    }
    for (const KnownEvent& event : model.events()) {
      listener.on_event(event.id, event.view);
    }
    model = {};
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return {};
  }

  Model model = test::plant();
};

class MonitorTextTest : public test::CommandTest<OnceSent> {
 protected:
  int monitor(const std::string& node, Filter filter = {}) {
    Model model;
    filter_ = std::move(filter);
    const int code = find_node(context_, model, node, filter_);
    return code != kDone ? code
                         : monitor_text(context_, {.once = true, .filter = filter_}, model,
                                        [] { return false; });
  }
  Filter filter_;
};

TEST_F(MonitorTextTest, ANodeByItsNameHasItsRowsAndItsEvents) {
  for (const std::string line : {"press", "plant/press", "3", ""}) {
    gateway_.model = test::plant();
    out_.str("");
    EXPECT_EQ(monitor("ram", {.line = line}), kDone) << line << ": " << err_.str();
    EXPECT_EQ(filter_.node, 5);
    EXPECT_THAT(out_.str(), AllOf(HasSubstr("ram.Position"), HasSubstr("ram.Controlword"),
                                  HasSubstr("second"), Not(HasSubstr("climate"))))
        << line;
    EXPECT_EQ(err_.str(), "");
  }
  EXPECT_EQ(filter_.line, "press") << "the only line with a node of this name";
}

// A gateway keeps the events of lines that a reload has removed.
TEST_F(MonitorTextTest, ALineThatWasRemovedIsNotAwaited) {
  gateway_.model.on_gateway("plant", {.lines = {{"press", ""}, {"hall", ""}}});
  gateway_.model.on_event({"plant", "old"}, {});
  EXPECT_EQ(monitor("5"), kDone) << err_.str();
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("removed"), Not(HasSubstr("no layout"))));
}

TEST_F(MonitorTextTest, ANodeByItsNumberNeedsNoLine) {
  EXPECT_EQ(monitor("5"), kDone) << err_.str();
  EXPECT_EQ(filter_.line, "");
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("ram.Position"), Not(HasSubstr("climate.Temp"))));
}

TEST_F(MonitorTextTest, ANameOfNodesOnTwoLinesNeedsALine) {
  gateway_.model.on_node(test::kHall, {.name = "ram", .state = {.node = 7}});
  const Model both = gateway_.model;
  EXPECT_EQ(monitor("ram"), kFailed);
  EXPECT_EQ(err_.str(),
            "more than one node is called 'ram': hall:ram, press:ram; name its line with --line\n");
  gateway_.model = both;
  EXPECT_EQ(monitor("ram", {.line = "hall"}), kDone);
  EXPECT_EQ(filter_.node, 7);
}

TEST_F(MonitorTextTest, ALineIsNamedWithItsGatewayWhereTwoHaveItsName) {
  gateway_.model.on_line({"other", "press"}, test::line_view(9));
  gateway_.model.on_layout({"other", "press"}, {.id = 3});
  gateway_.model.on_layout({"other", "press"}, {.direction = image::Direction::outputs, .id = 3});
  gateway_.model.on_node({"other", "press"},
                         {.name = "saw", .state = {.node = 5, .configured = true}});
  EXPECT_EQ(monitor("ram"), kDone) << err_.str();
  EXPECT_EQ(filter_.line, "plant/press");
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("ram.Position"), Not(HasSubstr("saw"))));
}

TEST_F(MonitorTextTest, WhatIsNoNodeIsNamed) {
  EXPECT_EQ(monitor("128"), kUsage);
  EXPECT_EQ(monitor("own"), kUsage);
  err_.str("");
  EXPECT_EQ(monitor("ran"), kFailed);
  EXPECT_EQ(err_.str(), "no node 'ran' on any line; there are: hall:climate (10), press:ram (5)\n");
  err_.str("");
  gateway_.model = test::plant();
  EXPECT_EQ(monitor("ran", {.line = "press"}), kFailed);
  EXPECT_EQ(err_.str(), "no node 'ran' on press; there are: ram (5)\n");
  err_.str("");
  EXPECT_EQ(monitor("ram"), kFailed);
  EXPECT_EQ(err_.str(), no_gateway_text(context_) + '\n');
}

TEST_F(MonitorTextTest, ANameIsNotGuessedWhileAGatewayIsMissing) {
  LineView view = test::line_view(3);
  view.properties = {{"other-gateways", "spare"}};
  gateway_.model.on_line(test::kPress, view);
  EXPECT_EQ(monitor("ram"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("'ram' may be ambiguous: nothing was received of gateway "
                                    "spare; name its line with --line"));
}

}  // namespace
}  // namespace linegate::console
