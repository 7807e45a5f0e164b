// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/lss.h"

#include <deque>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stack/lss/procedure.h"

namespace linegate::console {
namespace {

using lss::Procedure;

const lss::Address kDevice{0x4C47, 0x4020, 0x10000, 0x1F5};
const std::string kDeviceText = "4C47:4020:10000:1F5";

std::vector<std::byte> raw(std::initializer_list<int> numbers) {
  std::vector<std::byte> out;
  for (const int number : numbers) {
    out.push_back(static_cast<std::byte>(number));
  }
  return out;
}

std::vector<std::byte> with_address(std::initializer_list<int> head) {
  std::vector<std::byte> out = raw(head);
  lss::put(kDevice, out);
  return out;
}

// A line that gives the answers of the test, and answers "done" to all other requests.
class LssLine : public Client {
 public:
  void poll(Duration timeout, Listener& listener) override {
    LineView view{.interface_uri = "virtual:press"};
    view.state.node_id = 127;
    listener.on_line({"plant", "press"}, view);
    if (late > 0) {  // other nodes are received already, one of which is not configured
      view.state.nodes_configured = 2;
      listener.on_line({"plant", "press"}, view);
      NodeView other{.name = "saw"};
      other.state.node = 8;
      other.state.configured = true;
      listener.on_node({"plant", "press"}, other);
      other.state.node = 9;
      other.state.configured = false;
      listener.on_node({"plant", "press"}, other);
      std::this_thread::sleep_for(timeout);
      --late;
      return;
    }
    NodeView node{.name = "ram"};
    node.state.configured = true;
    node.state.node = 5;
    node.state.presence = present;
    node.state.heartbeat_monitored = watched;
    listener.on_node({"plant", "press"}, node);
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    const auto& request = std::get<line::LssRequest>(command.request);
    asked.emplace_back(request.procedure, request.arguments);
    Answer out;
    out.reply.data = raw({0, 0, 0});
    if (!answers.empty()) {
      out = answers.front();
      answers.pop_front();
    }
    return out;
  }
  void will_answer(std::vector<std::byte> data) {
    Answer answer;
    answer.reply.data = std::move(data);
    answers.push_back(std::move(answer));
  }

  manager::Presence present = manager::Presence::present;
  bool watched = true;
  int late = 0;  // number of polls until the node is received
  std::deque<Answer> answers;
  std::vector<std::pair<Procedure, std::vector<std::byte>>> asked;
};

class LssCommand : public ::testing::Test {
 protected:
  int run(LssRequest request, bool json = false) {
    request.line = "press";
    Context context{.client = line, .out = out, .err = err, .json = json, .wait = wait};
    return lss(context, request);
  }
  std::vector<Procedure> procedures() const {
    std::vector<Procedure> all;
    for (const auto& [procedure, data] : line.asked) {
      all.push_back(procedure);
    }
    return all;
  }

  LssLine line;
  Duration wait = Duration::zero();
  std::ostringstream out;
  std::ostringstream err;
};

using Procedures = std::vector<Procedure>;

TEST_F(LssCommand, ScanFindsOneAfterTheOtherAndLeavesThemAsTheyWere) {
  line.will_answer(with_address({0, 0, 0}));
  line.will_answer(raw({1, 0, 0}));
  EXPECT_EQ(run({.what = "scan"}), kDone);
  EXPECT_EQ(out.str(), kDeviceText + "\n");
  EXPECT_EQ(procedures(),
            (Procedures{Procedure::fastscan, Procedure::fastscan, Procedure::switch_global}));
  EXPECT_EQ(line.asked.back().second, raw({0})) << "switches all slaves to state waiting";
}

TEST_F(LssCommand, ScanAsJson) {
  line.will_answer(with_address({0, 0, 0}));
  line.will_answer(raw({1, 0, 0}));
  EXPECT_EQ(run({.what = "scan"}, true), kDone);
  const auto json = nlohmann::json::parse(out.str());
  EXPECT_EQ(json["devices"][0]["serial"], 0x1F5);
}

TEST_F(LssCommand, ANodeIdIsGivenToTheDeviceOfThatAddress) {
  EXPECT_EQ(run({.what = "set-node-id", .address = kDeviceText, .value = "9", .store = true}),
            kDone)
      << err.str();
  EXPECT_EQ(procedures(), (Procedures{Procedure::switch_selective, Procedure::configure_node_id,
                                      Procedure::store, Procedure::switch_global}));
  EXPECT_EQ(line.asked[0].second, with_address({}));
  EXPECT_EQ(line.asked[1].second, raw({9}));
}

TEST_F(LssCommand, ANodeIdThatAnotherHasIsGivenToNobody) {
  line.will_answer(raw({0, 0, 0}));
  line.will_answer(raw({4, 0, 0}));
  EXPECT_EQ(run({.what = "set-node-id", .address = kDeviceText, .value = "5"}), kFailed);
  EXPECT_NE(err.str().find("node-ID 5 is used by ram: "), std::string::npos) << err.str();
  EXPECT_EQ(procedures(), (Procedures{Procedure::switch_selective, Procedure::configure_node_id,
                                      Procedure::switch_global}));
  line.will_answer(raw({0, 0, 0}));
  line.will_answer(raw({4, 0, 0}));
  EXPECT_EQ(run({.what = "set-node-id", .address = kDeviceText, .value = "127"}), kFailed);
  EXPECT_NE(err.str().find("127 is used by the gateway's own node"), std::string::npos);
  line.will_answer(raw({0, 0, 0}));
  line.will_answer(raw({4, 0, 0}));
  EXPECT_EQ(run({.what = "set-node-id", .address = kDeviceText, .value = "9"}), kFailed);
  EXPECT_NE(err.str().find("9 is used by another device"), std::string::npos) << err.str();
}

TEST_F(LssCommand, ANodeIdInUseIsGivenWithForceAlone) {
  EXPECT_EQ(run({.what = "set-node-id", .address = kDeviceText, .value = "5", .force = true}),
            kDone);
  EXPECT_EQ(line.asked[1].second, raw({5, 1}));
}

TEST_F(LssCommand, OnlyIsRefusedWhereSeveralDevicesAnswer) {
  for (const char* what : {"inquire", "set-node-id", "bit-timing", "store"}) {
    line.asked.clear();
    line.will_answer(raw({0, 0, 0}));
    line.will_answer(raw({3, 0, 0}));
    const std::string value = std::string_view(what) == "bit-timing" ? "250" : "9";
    EXPECT_EQ(run({.what = what, .only = true, .value = value}), kFailed);
    EXPECT_NE(err.str().find("several devices answer"), std::string::npos) << err.str();
    EXPECT_EQ(procedures(), (Procedures{Procedure::switch_global, Procedure::inquire_address,
                                        Procedure::switch_global}));
  }
}

TEST_F(LssCommand, ARefusalEndsItAndTheDeviceDoesNotStayInConfiguration) {
  line.will_answer(raw({0, 0, 0}));
  line.will_answer(raw({2, 255, 7}));
  EXPECT_EQ(run({.what = "bit-timing", .address = kDeviceText, .value = "250", .store = true}),
            kFailed);
  EXPECT_NE(err.str().find("error 255/7"), std::string::npos) << err.str();
  EXPECT_EQ(procedures(), (Procedures{Procedure::switch_selective, Procedure::configure_bit_timing,
                                      Procedure::switch_global}));
  EXPECT_EQ(line.asked[1].second, raw({0, 3}));
  line.asked.clear();
  EXPECT_EQ(run({.what = "bit-timing", .address = kDeviceText, .value = "250kbit"}), kDone);
  EXPECT_EQ(line.asked[1].second, raw({0, 3})) << "in the notation of plant.yaml";
}

TEST_F(LssCommand, InquiresTheOnlyDevice) {
  line.will_answer(raw({0, 0, 0}));
  line.will_answer(with_address({0, 0, 0}));
  line.will_answer(raw({0, 0, 0, 255}));
  EXPECT_EQ(run({.what = "inquire", .only = true}), kDone) << err.str();
  EXPECT_EQ(out.str(), kDeviceText + " without a node-ID\n");
}

TEST_F(LssCommand, NobodyThereIsSaid) {
  line.will_answer(raw({1, 0, 0}));
  EXPECT_EQ(run({.what = "inquire", .address = kDeviceText}), kFailed);
  EXPECT_NE(err.str().find("no device answered"), std::string::npos) << err.str();
}

TEST_F(LssCommand, AssignSaysWhatCameOfEachDevice) {
  line.will_answer(with_address({0, 0, 0, 0, 5, 0, 0}));
  EXPECT_EQ(run({.what = "assign"}), kDone);
  EXPECT_EQ(out.str(), kDeviceText + " node 5: was given its node-ID\n");
  line.will_answer(with_address({0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(run({.what = "assign"}), kFailed) << "an unknown one";
}

TEST_F(LssCommand, AllThatWereGivenABitRateActivateIt) {
  EXPECT_EQ(run({.what = "activate", .value = "1000"}), kDone);
  EXPECT_EQ(line.asked[0], (std::pair{Procedure::switch_global, raw({1})}));
  EXPECT_EQ(line.asked[1], (std::pair{Procedure::activate_bit_timing, raw({0xE8, 3})}));
}

TEST_F(LssCommand, NonsenseReachesNoDevice) {
  EXPECT_EQ(run({.what = "inquire"}), kUsage);
  EXPECT_EQ(run({.what = "inquire", .address = "1:2:3"}), kUsage);
  EXPECT_EQ(run({.what = "set-node-id", .address = kDeviceText, .value = "128"}), kUsage);
  EXPECT_EQ(run({.what = "bit-timing", .address = kDeviceText, .value = "333"}), kUsage);
  EXPECT_EQ(run({.what = "activate", .value = "soon"}), kUsage);
  EXPECT_TRUE(line.asked.empty());
}

TEST(LssAddress, IsFourHexadecimalNumbers) {
  EXPECT_EQ(parse_lss_address(kDeviceText), kDevice);
  EXPECT_EQ(parse_lss_address("0x4C47:0x4020:0x10000:0x1F5"), kDevice);
  EXPECT_EQ(lss_address_text(kDevice), kDeviceText);
  for (const char* wrong : {"", "1", "1:2:3", "1:2:3:4:5", "1:2:3:x", "1:2:3:100000000", ":::"}) {
    EXPECT_FALSE(parse_lss_address(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace linegate::console
