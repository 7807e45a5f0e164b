// SPDX-License-Identifier: Apache-2.0
// An output that has a value only as long as the console writes it.
#include "bridges/console/hold.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::Each;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

// One line with one output, whose image shows the written value.
class Output : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    polls += writes.empty() ? 0 : 1;
    if (during) {
      during(polls);
    }
    if (gone) {
      listener.on_line_gone(test::kPress);
      return;
    }
    LineView view = test::line_view(3);
    if (!groups.empty()) {
      view.properties = {{"output-groups", groups}};
    }
    view.state.counters.events = 6;
    view.incarnation = incarnation;
    listener.on_line(test::kPress, view);
    image::Layout layout{.direction = image::Direction::outputs, .id = 5, .byte_size = 2};
    layout.entries.push_back(
        {.bit_length = 16,
         .type = od::DataType::unsigned16,
         .node = 8,
         .index = 0x6411,
         .sub = 1,
         .name = writes.size() < renamed_after ? "panel.Level" : "panel.Other"});
    listener.on_layout(test::kPress, layout);
    image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 5, .sequence = 1};
    image.bytes = shown;
    image.changed = {0};
    image.valid = {is_sent ? 1U : 0U};
    image.known = {1};
    listener.on_image(test::kPress, image);
    listener.on_event(test::kPress, test::event(EventKind::output_refused, 6, 0, "an older one"));
    if (takes && !writes.empty()) {
      OutputStateView view_of_group{.incarnation = incarnation};
      view_of_group.state.group = writes.back().group;
      view_of_group.state.arming = owner.empty() ? writes.back().arming : 1;
      view_of_group.state.owner = owner;
      view_of_group.state.applied = 1;
      if (!refused_client.empty() && writes.size() > 1) {
        view_of_group.state.refusal = line::OutputRefusal::not_armed;
        view_of_group.state.refused = refused;
        view_of_group.state.refused_client = refused_client;
      }
      listener.on_output_state(test::kPress, view_of_group);
    }
    if (refuses && !writes.empty() && ++polls_after > 1) {
      listener.on_event(test::kPress, test::event(EventKind::output_refused, 7, 0, refusal_text));
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    ADD_FAILURE() << "hold() must not send a command whose value stays";
    return {};
  }
  std::string name() const override { return own_name; }
  bool write_outputs(const LineId& id, std::uint64_t of, const line::OutputWrite& write) override {
    EXPECT_EQ(id, test::kPress);
    EXPECT_EQ(of, 4U);
    writes.push_back(write);
    if (takes) {
      shown = {write.values.at(0).data[0], write.values.at(0).data[1]};
    }
    return is_published;
  }

  std::string groups;
  std::size_t renamed_after = 1'000;  // writes
  bool takes = true;
  bool refuses = false;  // rejects at the second poll after the first write
  std::string refusal_text = "refused";
  std::string own_name;
  std::string refused_client;  // in the state of the group, from the second write on
  std::uint64_t refused = 1;
  int polls_after = 0;
  int polls = 0;                    // since the first write
  std::function<void(int)> during;  // called in each poll with their number
  std::uint64_t incarnation = 4;
  bool gone = false;
  bool is_sent = true;
  bool is_published = true;
  std::string owner;  // another client that writes the group
  std::vector<std::byte> shown{std::byte{}, std::byte{}};
  std::vector<line::OutputWrite> writes;
};

class HoldTest : public test::CommandTest<Output> {
 protected:
  // Returns a condition that is true once `samples` samples were written.
  std::function<bool()> after(std::size_t samples) {
    return [this, samples] { return gateway_.writes.size() >= samples; };
  }
};

TEST_F(HoldTest, WritesAgainAndAgainUnderAWatchdogThatZeroesTheGroup) {
  const HoldRequest request{.line = "press", .entry = "panel.6411:01", .value = "300", .group = 2};
  EXPECT_EQ(hold(context_, request, after(3)), kDone) << err_.str();
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::reactions, line::kZeroOutputs)));
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::watchdog, kHoldWatchdog)));
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::group, 2)));
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::layout_id, 5U)));
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::arming, gateway_.writes[0].arming)));
  EXPECT_NE(gateway_.writes[0].arming, 0U);
  EXPECT_EQ(gateway_.shown, test::raw({0x2C, 1}));
  EXPECT_THAT(err_.str(), HasSubstr("the outputs of group 2 become 0 2 s after the end"));
}

TEST_F(HoldTest, TakesTheGroupOfTheEntryWhereNoneIsGiven) {
  gateway_.groups = "1 1..5, 7 6, 2 0";
  const HoldRequest request{.line = "press", .entry = "panel.6411:01", .value = "300"};
  EXPECT_EQ(hold(context_, request, after(1)), kDone) << err_.str();
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::group, 2)));
  EXPECT_THAT(err_.str(), HasSubstr("the outputs of group 2 become 0"));
}

TEST_F(HoldTest, TheGroupOfALineWithoutGroupsIsZero) {
  EXPECT_EQ(hold(context_, {.line = "press", .entry = "0", .value = "1"}, after(1)), kDone);
  EXPECT_THAT(gateway_.writes, Each(Field(&line::OutputWrite::group, 0)));
}

TEST_F(HoldTest, AnEntryWithoutAGroupIsNotWritten) {
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  gateway_.groups = "1 1..5";
  EXPECT_EQ(hold(context_, request, after(1)), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("panel.Level is in no group of outputs: add it to one"));
  gateway_.groups = "1 1..5, +3";
  EXPECT_EQ(hold(context_, request, after(1)), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("panel.Level: its group of outputs is not known, give it with "
                                    "--group"));
  EXPECT_THAT(gateway_.writes, IsEmpty());
}

TEST_F(HoldTest, TheRefusalOfAnotherGroupNamesThatOfTheEntry) {
  gateway_.groups = "2 0, 3 1";
  gateway_.refuses = true;
  gateway_.takes = false;
  const HoldRequest request{.line = "press", .entry = "0", .value = "1", .group = 0};
  EXPECT_EQ(hold(context_, request, [] { return false; }), kFailed);
  EXPECT_EQ(err_.str(), "refused; the output is in group 2: --group 2, or no --group\n");
}

TEST_F(HoldTest, EndsWithTheRefusalOfTheLine) {
  gateway_.refuses = true;
  gateway_.takes = false;
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, [] { return false; }), kFailed);
  EXPECT_EQ(err_.str(), "refused\n");
}

TEST_F(HoldTest, EndsWhenTheNameMovesToAnotherOutput) {
  gateway_.renamed_after = 2;
  HoldRequest request{.line = "press", .entry = "panel.Level", .value = "300", .group = 2};
  EXPECT_EQ(hold(context_, request, after(100)), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("panel.Level is panel.Other since a reload"));
  EXPECT_EQ(gateway_.writes.size(), 2U);
  request.entry = "panel.6411:01";
  gateway_.renamed_after = 4;
  EXPECT_EQ(hold(context_, request, after(6)), kFailed);
  EXPECT_EQ(gateway_.writes.size(), 6U) << "it is the same output";
  EXPECT_THAT(err_.str(), testing::EndsWith("not held any more: no image of the outputs of press "
                                            "has come since it was started again\n"
                                            "panel.Level is not held at the end\n"));
}

TEST_F(HoldTest, AValueThatIsThereAlreadyIsNotHeldBeforeTheLineTakesIt) {
  gateway_.refuses = true;
  gateway_.takes = false;
  gateway_.shown = {std::byte{1}, std::byte{0}};
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, [] { return false; }), kFailed);
  EXPECT_EQ(err_.str(), "refused\n");
}

TEST_F(HoldTest, RefusedWritesOfOtherClientsHaveNoEffect) {
  gateway_.own_name = "host/7/1";
  gateway_.refuses = true;
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  for (const std::string other : {"hmi", "host/7/12", "myhost/7/1", "client 4"}) {
    gateway_.writes.clear();
    gateway_.refusal_text = "outputs of group 0 of " + other + " at panel refused: not armed";
    gateway_.refused_client = other;
    EXPECT_EQ(hold(context_, request, after(4)), kDone) << other << ": " << err_.str();
  }
  gateway_.writes.clear();
  gateway_.refusal_text = "outputs of group 0 of host/7/1 at panel refused: not armed";
  EXPECT_EQ(hold(context_, request, after(100)), kFailed);
  EXPECT_THAT(err_.str(), testing::EndsWith(gateway_.refusal_text + "\n"));
}

TEST_F(HoldTest, TheStateOfTheGroupShowsARefusalWhoseEventWasLost) {
  gateway_.own_name = "host/7/1";
  gateway_.refused_client = "host/7/1";
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, after(100)), kFailed);
  EXPECT_THAT(err_.str(),
              testing::EndsWith("outputs of group 0 refused: " +
                                std::string(describe(line::OutputRefusal::not_armed)) + "\n"));
  gateway_.writes.clear();
  gateway_.refused = 0;
  EXPECT_EQ(hold(context_, request, after(4)), kDone) << "a refusal before the first write";
}

TEST_F(HoldTest, IsNotArmedAgainInAnotherIncarnationOfTheGateway) {
  gateway_.during = [this](int polls) { gateway_.incarnation = polls > 3 ? 5 : 4; };
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, after(100)), kFailed);
  EXPECT_THAT(err_.str(),
              testing::EndsWith("the gateway of press was started again: panel.Level is "
                                "not written any more, decide again\n"));
}

TEST_F(HoldTest, AnOutputThatIsNotSentForATimeHasFailed) {
  gateway_.during = [this](int polls) { gateway_.is_sent = polls < 3 || polls > 6; };
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, [this] { return gateway_.polls >= 10; }), kFailed);
  EXPECT_THAT(err_.str(), testing::EndsWith("not held any more: panel.Level waits for own node, "
                                            "which is initialising\nheld again\npanel.Level was "
                                            "not held all the time\n"));
}

TEST_F(HoldTest, AnOutputThatIsNotSentAtTheEndIsHeldBack) {
  gateway_.during = [this](int polls) { gateway_.is_sent = polls < 3; };
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, [this] { return gateway_.polls >= 10; }), kHeldBack);
  EXPECT_THAT(err_.str(), testing::EndsWith("panel.Level was written, and not sent: waits for own "
                                            "node, which is initialising\n"));
  gateway_.polls = 0;
  gateway_.during = {};
  context_.timeout = std::chrono::milliseconds(1);
  EXPECT_EQ(hold(context_, request, after(100)), kHeldBack) << "it never was";
}

TEST_F(HoldTest, AnOutputThatAnotherClientTakesOverIsNotHeld) {
  gateway_.during = [this](int polls) { gateway_.owner = polls < 3 ? "" : "panel-pc"; };
  const HoldRequest request{.line = "press", .entry = "0", .value = "1", .group = 2};
  EXPECT_EQ(hold(context_, request, [this] { return gateway_.polls >= 10; }), kFailed);
  EXPECT_THAT(err_.str(), testing::EndsWith("not held any more: panel-pc writes group 2\n"
                                            "panel.Level is not held at the end\n"));
}

TEST_F(HoldTest, AnOutputWhoseGatewayHasEndedIsNotHeld) {
  gateway_.during = [this](int polls) { gateway_.gone = polls > 3; };
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, [this] { return gateway_.polls >= 10; }), kFailed);
  EXPECT_THAT(
      err_.str(),
      HasSubstr("not held any more: the gateway of press has ended, or cannot be reached\n"));
}

TEST_F(HoldTest, AValueThatDdsDoesNotTakeIsNotHeld) {
  gateway_.during = [this](int polls) { gateway_.is_published = polls < 3; };
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, after(4)), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("not held any more: DDS does not take the value\n"));
}

TEST_F(HoldTest, FailsWhenTheImageDoesNotShowTheValue) {
  gateway_.takes = false;
  context_.timeout = std::chrono::milliseconds(1);
  const HoldRequest request{.line = "press", .entry = "0", .value = "1"};
  EXPECT_EQ(hold(context_, request, [] { return false; }), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("the image of press does not show the value"));
  EXPECT_EQ(hold(context_, {.line = "press", .entry = "x.y", .value = "1"}, after(0)), kUsage);
  EXPECT_EQ(hold(context_, {.line = "press", .entry = "0", .value = "70000"}, after(0)), kUsage);
}

}  // namespace
}  // namespace linegate::console
