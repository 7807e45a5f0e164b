// SPDX-License-Identifier: Apache-2.0
// The line that a command is sent to when the domain has several gateways, some of which are
// received late.
#include "bridges/console/discovery.h"

#include <chrono>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const LineId kOtherPress{"other", "press"};

LineView line_of_gateway(const std::string& lines, const std::string& others) {
  LineView view = test::line_view(3);
  view.properties = {{"lines", lines}, {"other-gateways", others}};
  return view;
}

// The gateway "plant" with the line press. The gateway "other" also has a line press, which is
// received with a later poll.
class TwoGateways : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    ++polls;
    listener.on_line(test::kPress, plant);
    unheard.name.empty() ? void() : listener.on_node(test::kPress, unheard);
    if (has_image) {
      listener.on_layout(test::kPress, {.direction = image::Direction::inputs, .id = 5});
      listener.on_image(test::kPress, {.direction = image::Direction::inputs, .layout_id = 5});
    }
    if (polls > other_after) {
      listener.on_line(kOtherPress, line_of_gateway("1", "plant"));
    }
  }
  Discovery discovery() const override { return discovered; }
  Answer call(const LineId& id, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    asked.push_back(id);
    return {};
  }
  Answer call_gateway(const LineId& id, const request::GatewayRequest& /*request*/,
                      Duration /*timeout*/, Listener& /*listener*/) override {
    asked_gateways.push_back(id);
    return {};
  }

  std::vector<LineId> asked_gateways;
  int polls = 0;
  int other_after = 1'000'000'000;
  LineView plant = line_of_gateway("1", "other");
  NodeView unheard;
  bool has_image = false;  // an empty one of the inputs
  Discovery discovered;
  std::vector<LineId> asked;
};

class DiscoveryTest : public test::CommandTest<TwoGateways> {
 protected:
  int read(const std::string& node) { return sdo_read(context_, node, "1000", "0", "u32"); }
};

TEST_F(DiscoveryTest, ANameThatALaterGatewayHasTooIsRefused) {
  gateway_.other_after = 200;
  context_.wait = std::chrono::minutes(10);
  EXPECT_EQ(read("press:5"), kFailed);
  EXPECT_EQ(err_.str(), "the name matches more than one line: other/press or plant/press\n");
  EXPECT_THAT(gateway_.asked, IsEmpty());
}

TEST_F(DiscoveryTest, ANameIsRefusedWhileAGatewayIsNotReceived) {
  EXPECT_EQ(read("press:5"), kFailed);
  EXPECT_EQ(err_.str(),
            "'press' may be ambiguous: nothing was received of gateway other; name the line as "
            "plant/press, or use a longer --wait\n");
  EXPECT_THAT(gateway_.asked, IsEmpty());
  EXPECT_EQ(read("plant/press:5"), kDone) << "the full name is unambiguous";
  EXPECT_EQ(read("plant/3:5"), kDone) << "gateway and network-ID are unambiguous";
  EXPECT_THAT(gateway_.asked, ElementsAre(test::kPress, test::kPress));
}

TEST_F(DiscoveryTest, AGatewayThatOnlyItsParticipantShowsIsWaitedFor) {
  gateway_.plant = line_of_gateway("1", "");
  EXPECT_EQ(read("press:5"), kDone);
  gateway_.discovered.gateways = {"other"};
  EXPECT_EQ(read("press:5"), kFailed);
  gateway_.discovered.gateways = {"plant"};
  EXPECT_EQ(read("press:5"), kDone);
  gateway_.discovered.unchanged = std::chrono::milliseconds(100);
  EXPECT_EQ(read("press:5"), kFailed) << "gateways have recently appeared or left";
  EXPECT_EQ(gateway_.asked.size(), 2U);
}

TEST_F(DiscoveryTest, AllLinesOfAGatewayAreWaitedFor) {
  gateway_.plant = line_of_gateway("3", "");
  EXPECT_EQ(read("3:5"), kFailed) << "another line may have that network-ID";
  EXPECT_THAT(err_.str(), HasSubstr("nothing was received of 2 of 3 lines of gateway plant"));
}

TEST_F(DiscoveryTest, AGatewayWhoseNameAnotherHasGetsNoCommand) {
  gateway_.plant = line_of_gateway("1", "");
  gateway_.plant.properties.emplace_back("namesakes", "1");
  EXPECT_EQ(read("plant/press:5"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("more than one gateway is called 'plant'"));
  EXPECT_THAT(gateway_.asked, IsEmpty());
}

TEST_F(DiscoveryTest, ValuesOfSeveralGatewaysOfOneNameHaveTheStatusOfAnIncompleteList) {
  gateway_.plant = line_of_gateway("1", "");
  gateway_.has_image = true;
  gateway_.unheard = {.name = "ram", .state = {.node = 5, .configured = true}};
  EXPECT_EQ(lines(context_), kDone);
  EXPECT_EQ(nodes(context_, ""), kDone);
  EXPECT_EQ(image(context_, "press", image::Direction::inputs), kDone) << err_.str();
  EXPECT_EQ(err_.str(), "");
  gateway_.plant.properties.emplace_back("namesakes", "1");
  for (const auto& command : std::initializer_list<std::function<int()>>{
           [&] { return lines(context_); }, [&] { return nodes(context_, ""); },
           [&] { return image(context_, "press", image::Direction::inputs); }}) {
    err_.str("");
    EXPECT_EQ(command(), kIncomplete);
    EXPECT_EQ(err_.str(),
              "more than one gateway is called 'plant': values of all of them are mixed, and all "
              "execute commands\n");
  }
}

TEST_F(DiscoveryTest, AListThatIsNotCompleteSaysSoAndHasItsOwnStatus) {
  EXPECT_EQ(lines(context_), kIncomplete);
  EXPECT_EQ(routes(context_), kIncomplete);
  EXPECT_EQ(versions(context_, ""), kIncomplete);
  // Not of its line, which the identity of this client may not permit.
  EXPECT_EQ(gateway_.asked_gateways.back(), (LineId{"plant", ""}));
  EXPECT_THAT(err_.str(), HasSubstr("incomplete: nothing was received of gateway other\n"));
  EXPECT_THAT(out_.str(), HasSubstr("press"));
  gateway_.other_after = 0;
  EXPECT_EQ(lines(context_), kDone);
  EXPECT_EQ(nodes(context_, "press"), kIncomplete) << "the nodes of the lines are not received";
  EXPECT_THAT(err_.str(), HasSubstr("incomplete: nodes of plant/press\n"));
  EXPECT_EQ(image(context_, "", image::Direction::inputs), kIncomplete);
  EXPECT_THAT(err_.str(), HasSubstr("incomplete: the image of other/press\n"));
}

TEST_F(DiscoveryTest, ANodeThatAnObserverNeverHeardIsWaitedForToo) {
  gateway_.plant = line_of_gateway("1", "");
  gateway_.plant.state.role = line::Role::observer;
  EXPECT_EQ(nodes(context_, "plant/press"), kIncomplete);
  EXPECT_THAT(err_.str(), HasSubstr("incomplete: nodes of plant/press\n"));
  gateway_.unheard = {.name = "ram", .state = {.node = 5, .configured = true}};
  EXPECT_EQ(nodes(context_, "plant/press"), kDone);
  EXPECT_THAT(out_.str(), HasSubstr("ram"));
}

// Such a command would otherwise wait until the test times out.
class NameThatAGatewayDoesNotHave : public DiscoveryTest {
 protected:
  NameThatAGatewayDoesNotHave() {
    context_.wait = std::chrono::hours(1);
    context_.quiet = Duration::zero();
    gateway_.plant = line_of_gateway("1", "other");  // which is never received
    gateway_.plant.properties.emplace_back("routes-0", "3 press 0,10..19 press:5 10,7 press:6 20");
  }
};

TEST_F(NameThatAGatewayDoesNotHave, IsRefusedWithoutTheOtherGateways) {
  EXPECT_EQ(read("plant/pres:5"), kFailed);
  EXPECT_EQ(err_.str(), "plant has no line 'pres'; its lines: press\n");
  err_.str("");
  EXPECT_EQ(object_write(context_, "plant/20:5", "1000", "0", "u32", "1", false), kFailed);
  EXPECT_EQ(err_.str(), "plant has no line '20'; its lines: press\n");
  EXPECT_THAT(gateway_.asked, IsEmpty());
}

TEST_F(NameThatAGatewayDoesNotHave, OfANetworkIsRefusedWithTheRoutes) {
  EXPECT_EQ(read("plant/20:5"), kFailed);
  EXPECT_EQ(err_.str(),
            "plant has no line '20' and no route to network 20; its lines: press; networks it "
            "reaches: 3, 7, 10..19\n");
  EXPECT_EQ(read("plant/7:5"), kDone);
  EXPECT_THAT(gateway_.asked, ElementsAre(test::kPress));
}

TEST_F(NameThatAGatewayDoesNotHave, IsWaitedForWhileALineIsNotReceived) {
  context_.wait = std::chrono::milliseconds(1);
  gateway_.plant.properties[0].second = "2";
  EXPECT_EQ(read("plant/hall:5"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("no line 'plant/hall'; lines found: press (gateway plant)"));
  err_.str("");
  EXPECT_EQ(read("plant/7:5"), kFailed) << "that line may have this network-ID";
  gateway_.plant.properties[0].second = "1";
  gateway_.discovered.unchanged = Duration::zero();
  err_.str("");
  EXPECT_EQ(read("plant/hall:5"), kFailed) << "gateways have recently appeared or left";
  EXPECT_THAT(err_.str(), HasSubstr("no line 'plant/hall'"));
}

TEST_F(NameThatAGatewayDoesNotHave, IsWaitedForIfItsGatewayIsNotReceived) {
  context_.wait = std::chrono::milliseconds(1);
  EXPECT_EQ(read("other/press:5"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("no line 'other/press'; lines found: press (gateway plant)"));
}

TEST_F(NameThatAGatewayDoesNotHave, IsFoundIfItComesWithin) {
  context_.quiet = std::chrono::hours(2);
  gateway_.other_after = 3;
  EXPECT_EQ(read("other/press:5"), kDone);
  EXPECT_THAT(gateway_.asked, ElementsAre(kOtherPress));
}

// Polls until the wait has passed are counted: a second wait would double them.
TEST_F(DiscoveryTest, ANetworkWithoutARouteIsWaitedForOnce) {
  context_.wait = Duration::zero();
  EXPECT_EQ(read("20:5"), kFailed);
  EXPECT_EQ(gateway_.polls, 1);
  EXPECT_EQ(err_.str(),
            "no line '20' and no route to network 20; lines found: press (gateway plant); nothing "
            "was received of gateway other; networks that gateways reach: none\n");
}

TEST(MissingLines, AreThoseThatGatewaysNameAsFarAsTheListHasRoom) {
  Model model;
  EXPECT_THAT(missing_lines(model, {"a"}), ElementsAre("gateway a"));
  model.on_line({"a", "press"}, line_of_gateway("2", "b,c,+2"));
  EXPECT_THAT(missing_lines(model, {}), ElementsAre("1 of 2 lines of gateway a", "gateway b",
                                                    "gateway c", "2 more gateways"));
  model.on_line_gone({"a", "press"});
  EXPECT_THAT(missing_lines(model, {}), IsEmpty());
}

}  // namespace
}  // namespace linegate::console
