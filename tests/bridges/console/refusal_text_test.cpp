// SPDX-License-Identifier: Apache-2.0
// The messages of the console for commands that a simulated gateway refuses, on a line with two
// nodes.
#include "bridges/console/refusal_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/boot.h"
#include "bridges/console/configuration.h"
#include "stack/manager/state.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using line::Refusal;
using testing::HasSubstr;

const LineId kSaw{"plant", "saw"};

class RefusingGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = "virtual:saw", .access = "all"};
    view.state.role = role;
    view.state.node_id = role == line::Role::manager ? 127 : 0;
    view.state.own_state = own_state;
    view.state.nodes_configured = 2;
    listener.on_line(kSaw, view);
    NodeView node{.name = "ram"};
    node.state.node = 5;
    node.state.configured = true;
    node.state.state = nmt::State::pre_operational;
    listener.on_node(kSaw, node);
    node.name = "";
    node.state.node = 8;
    listener.on_node(kSaw, node);
    node.state.node = 9;  // present, but not configured
    node.state.configured = false;
    listener.on_node(kSaw, node);
    image::Layout layout{.direction = image::Direction::outputs, .id = 77, .byte_size = 3};
    layout.entries.push_back({.node = 5, .remote_pdo = 1, .local_pdo = 11});
    layout.entries.push_back({.node = 5, .remote_pdo = 3, .local_pdo = 12});
    layout.entries.push_back({.node = 127, .index = 0x2000});
    listener.on_layout(kSaw, layout);
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    Answer out;
    if (refusal != Refusal::none) {
      out.reply.error = line::to_error(refusal);
      out.text = line::describe(refusal);
    }
    out.reply.data = data;
    return out;
  }

  Refusal refusal = Refusal::unknown_entry;
  line::ReplyData data;
  line::Role role = line::Role::manager;
  nmt::State own_state = nmt::State::operational;
};

class RefusalText : public test::CommandTest<RefusingGateway> {
 protected:
  std::string of_trigger(const std::string& what, const std::string& number,
                         bool by_offset = false) {
    err_.str("");
    EXPECT_EQ(pdo_trigger(context_, what, number, by_offset), kFailed);
    return err_.str();
  }
};

TEST_F(RefusalText, ATriggerNamesThePdosThatThereAre) {
  EXPECT_EQ(of_trigger("saw:5", "2"),
            "no such output entry: saw does not send to RPDO 2 of node 5; to its RPDOs: 1, 3\n");
  EXPECT_THAT(of_trigger("saw:8", "1"), HasSubstr("RPDO 1 of node 8; to its RPDOs: none"));
  EXPECT_THAT(of_trigger("saw", "40"),
              HasSubstr(": saw has no TPDO 40; the PDOs of its outputs: 11, 12"));
  EXPECT_THAT(of_trigger("saw", "3", true),
              HasSubstr("no PDO carries byte 3 of the outputs of saw, which have 3 bytes"));
}

TEST_F(RefusalText, ATriggerNamesTheNodesThatThereAre) {
  EXPECT_THAT(of_trigger("saw:9", "1"), HasSubstr("node 9 is none of saw; its nodes: 5 (ram), 8"));
  EXPECT_THAT(of_trigger("saw:127", "1"),
              HasSubstr("node 127 is the gateway's own on saw; its nodes: 5 (ram), 8"));
}

TEST_F(RefusalText, ATriggerSaysWhatIsNotInTheStateForIt) {
  gateway_.refusal = Refusal::wrong_state;
  EXPECT_THAT(of_trigger("saw:5", "1"), HasSubstr("was never written and has no default"));
  gateway_.own_state = nmt::State::stopped;
  EXPECT_THAT(of_trigger("saw", "11"),
              HasSubstr("the own node of saw is stopped, not operational"));
}

TEST_F(RefusalText, ATriggerOfADeviceSaysWhichOfThem) {
  gateway_.role = line::Role::device;
  EXPECT_THAT(of_trigger("saw:5", "2"), HasSubstr(": device 5 has no TPDO 2\n"));
  gateway_.refusal = Refusal::wrong_state;
  EXPECT_THAT(of_trigger("saw:5", "1"), HasSubstr("device 5 is pre-operational, not operational"));
  gateway_.refusal = Refusal::bad_request;
  EXPECT_THAT(of_trigger("saw", "1"), HasSubstr("devices have PDOs, not the line: LINE:NODE"));
  EXPECT_THAT(of_trigger("saw:7", "1"), HasSubstr("node 7 is none of saw"));
}

TEST_F(RefusalText, OtherRefusalsAreToldAsTheyAre) {
  gateway_.refusal = Refusal::not_permitted;
  EXPECT_EQ(of_trigger("saw:9", "1"), std::string(line::describe(Refusal::not_permitted)) + "\n");
}

TEST_F(RefusalText, ABootOfTheOwnNodeNamesTheOthers) {
  gateway_.refusal = Refusal::bad_request;
  EXPECT_EQ(boot(context_, "saw:127"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("node 127 is the gateway's own on saw; its nodes: 5 (ram), 8"));
}

TEST_F(RefusalText, ABootOfANodeThatIsNotConfiguredNamesThoseThatAre) {
  gateway_.refusal = Refusal::none;
  gateway_.data = std::vector{manager::BootOutcome{.node = 9, .letter = 'A', .finding = {}}};
  EXPECT_EQ(boot(context_, "saw:9"), kFailed);
  EXPECT_EQ(err_.str(), "node 9 is none of saw; its nodes: 5 (ram), 8\n");
  gateway_.data = std::vector{manager::BootOutcome{.node = 5, .letter = 'B', .finding = {}}};
  err_.str("");
  EXPECT_EQ(boot(context_, "saw:5"), kFailed);
  EXPECT_EQ(err_.str(), "") << "node 5 belongs to the line, but is silent";
}

TEST_F(RefusalText, AConfigurationOfANodeThatIsNotConfiguredNamesThoseThatAre) {
  gateway_.refusal = Refusal::bad_request;
  const std::string refused = std::string(line::describe(Refusal::bad_request)) + "\n";
  for (const ConfigAction action : {ConfigAction::verify, ConfigAction::apply}) {
    err_.str("");
    EXPECT_EQ(configure(context_, action, "saw:9"), kFailed);
    EXPECT_EQ(err_.str(), refused + "node 9 is none of saw; its nodes: 5 (ram), 8\n");
    err_.str("");
    EXPECT_EQ(configure(context_, action, "saw:8"), kFailed);
    EXPECT_EQ(err_.str(), refused) << "node 8 belongs to the line";
  }
}

}  // namespace
}  // namespace linegate::console
