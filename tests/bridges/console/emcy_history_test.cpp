// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/emcy_history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bridges/console/explain_words.h"
#include "stack/base/abort_code.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using test::as;

using test::raw;
using testing::HasSubstr;

const LineId kEmcyLine{"plant", "hall"};

// Two nodes. Node 5 has sent two EMCYs.
class Hall : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView line{.interface_uri = "virtual:hall", .access = "read"};
    line.state.nodes_configured = 2;
    line.state.role = role;
    listener.on_line(kEmcyLine, line);
    NodeView silent{.name = "belt"};
    silent.state.node = 4;
    listener.on_node(kEmcyLine, silent);
    NodeView loud{.name = "axis"};
    loud.state.node = 5;
    loud.state.emcy_count = 2;
    loud.state.last_emcy = 0x8110;
    loud.state.error_register = 0x11;
    listener.on_node(kEmcyLine, loud);
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    asked.push_back(command);
    return answer;
  }

  std::vector<line::Command> asked;
  Answer answer;
  line::Role role = line::Role::manager;
};

class EmcyHistory : public test::CommandTest<Hall> {
 protected:
  EmcyHistory() {
    gateway_.answer.reply.data =
        raw({2, 0x10, 0x81, 0x11, 0x2A, 0, 0, 0, 0, 0x00, 0x00, 0x00, 0, 0, 0, 0, 0});
  }
};

TEST(EmcyHistoryObject, TheNewestIsFirst) {
  const auto two =
      parse_history(raw({2, 0x10, 0x81, 0x11, 0x2A, 0, 0, 0, 0, 0x30, 0x81, 0x10, 0, 0, 0, 0, 7}));
  ASSERT_EQ(two.size(), 2U);
  EXPECT_EQ(two[0].code, 0x8130);
  EXPECT_EQ(two[0].info[4], std::byte{7});
  EXPECT_EQ(two[1].error_register, 0x11);
  std::vector<std::byte> full(33);
  for (std::size_t i = 0; i < 4; ++i) {
    full[1 + i * 8] = static_cast<std::byte>(i + 1);
  }
  full[0] = std::byte{2};
  const auto four = parse_history(full);
  ASSERT_EQ(four.size(), 4U);
  EXPECT_EQ(four[0].code, 2);
  EXPECT_EQ(four[1].code, 1);
  EXPECT_EQ(four[2].code, 4);
  EXPECT_EQ(four[3].code, 3);
}

TEST(EmcyHistoryObject, WhatMakesNoSenseIsNothing) {
  EXPECT_TRUE(parse_history({}).empty());
  EXPECT_TRUE(parse_history(raw({0})).empty());
  EXPECT_TRUE(parse_history(raw({1, 2, 3})).empty());
  EXPECT_TRUE(parse_history(raw({2, 0, 0, 0, 0, 0, 0, 0, 0})).empty());
}

TEST_F(EmcyHistory, OfALineAreThoseOfNodesThatSentSome) {
  EXPECT_EQ(emcy_history(context_, "hall"), kDone);
  ASSERT_EQ(gateway_.asked.size(), 1U);
  EXPECT_EQ(std::get<od::Address>(as<line::LocalRead>(gateway_.asked[0]).what),
            (od::Address{0x5F18, 5}));
  EXPECT_THAT(out_.str(), testing::StartsWith("hall:5 axis, 2 EMCYs received\n  0000  "));
  EXPECT_THAT(out_.str(), HasSubstr("\n  8110  "));
  EXPECT_THAT(out_.str(), HasSubstr("error register 11 (generic, communication), data 2A 00"));
}

TEST_F(EmcyHistory, OfOneNodeIsAskedWhateverIsKnownOfIt) {
  gateway_.answer.reply.data = raw({0});
  EXPECT_EQ(emcy_history(context_, "hall:4"), kDone);
  EXPECT_EQ(std::get<od::Address>(as<line::LocalRead>(gateway_.asked.at(0)).what).sub, 4);
  EXPECT_EQ(out_.str(), "hall:4 belt, 0 EMCYs received\n");
}

TEST_F(EmcyHistory, OfAnUnknownNodeIsAnError) {
  EXPECT_EQ(emcy_history(context_, "hall:77"), kFailed);
  EXPECT_EQ(out_.str(), "");
  EXPECT_EQ(err_.str(), "no node '77' on hall; there are: belt (4), axis (5)\n");
  EXPECT_TRUE(gateway_.asked.empty());
}

// It has no object dictionary; NodeState has the last EMCY.
TEST_F(EmcyHistory, OfAnObserverIsTheLastOneOfEachNode) {
  gateway_.role = line::Role::observer;
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_role);
  EXPECT_EQ(emcy_history(context_, "hall"), kDone);
  EXPECT_TRUE(gateway_.asked.empty());
  EXPECT_EQ(out_.str(), "hall:5 axis, 2 EMCYs received\n  8110  " + describe_error_code(0x8110) +
                            ", error register 11 (generic, communication)\n");
  out_.str({});
  context_.json = true;
  EXPECT_EQ(emcy_history(context_, "hall:5"), kDone);
  const auto json = nlohmann::json::parse(out_.str());
  EXPECT_EQ(json["nodes"][0]["emcys"].size(), 1U);
  EXPECT_EQ(json["nodes"][0]["emcys"][0]["code"], 0x8110);
  EXPECT_FALSE(json["nodes"][0]["emcys"][0].contains("bytes"));
}

TEST_F(EmcyHistory, AsJson) {
  context_.json = true;
  EXPECT_EQ(emcy_history(context_, "hall:5"), kDone);
  const auto json = nlohmann::json::parse(out_.str());
  EXPECT_EQ(json["line"], "hall");
  EXPECT_EQ(json["nodes"][0]["received"], 2);
  EXPECT_EQ(json["nodes"][0]["emcys"][1]["code"], 0x8110);
  EXPECT_EQ(json["nodes"][0]["emcys"][1]["bytes"], "2A 00 00 00 00");
}

TEST_F(EmcyHistory, ARefusalIsSaid) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::not_permitted);
  gateway_.answer.text = "not permitted";
  EXPECT_EQ(emcy_history(context_, "hall:5"), kFailed);
  EXPECT_EQ(err_.str(), "not permitted\n");
}

// The gateway receives no EMCYs of its own devices. They store their errors in 1003h.
class Stage : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView line{.interface_uri = "virtual:hall", .access = "read"};
    line.state.role = role;
    line.state.node_id = role == line::Role::device ? std::uint8_t{0} : std::uint8_t{127};
    line.state.nodes_configured = 2;
    listener.on_line(kEmcyLine, line);
    for (const auto& [id, name] : {std::pair<std::uint8_t, std::string>{20, "lamp"}, {21, "fan"}}) {
      NodeView device{.name = name};
      device.state.node = id;
      device.state.configured = true;
      listener.on_node(kEmcyLine, device);
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    const auto& read = as<line::LocalRead>(command);
    const auto address = std::get<od::Address>(read.what);
    asked.push_back(read.node);
    EXPECT_EQ(address.index, 0x1003);
    Answer out;
    if (read.node == 21) {
      out.reply.error = to_error(AbortCode::no_object);
    } else {
      out.reply.data = address.sub == 0   ? raw({2})
                       : address.sub == 1 ? raw({0x00, 0x60, 0x34, 0x12})
                                          : raw({0x00, 0x50, 0, 0});
    }
    return out;
  }

  line::Role role = line::Role::device;
  std::vector<std::uint8_t> asked;
};

using StoredErrorHistory = test::CommandTest<Stage>;

TEST_F(StoredErrorHistory, OfOwnDevicesIsThatOfTheirDictionaries) {
  EXPECT_EQ(emcy_history(context_, "hall"), kDone) << err_.str();
  EXPECT_THAT(out_.str(), testing::StartsWith("hall:20 lamp, 2 errors in 1003h\n  6000  "));
  EXPECT_THAT(out_.str(), HasSubstr(", additional information 1234\n  5000  "));
  EXPECT_THAT(out_.str(), testing::EndsWith("hall:21 fan, has no 1003h: it stores no errors\n"));
  gateway_.asked.clear();
  EXPECT_EQ(emcy_history(context_, "hall:lamp"), kDone);
  EXPECT_THAT(gateway_.asked, testing::Each(20));
}

TEST_F(StoredErrorHistory, OfTheOwnNodeIsThatOfItsDictionary) {
  gateway_.role = line::Role::manager;
  EXPECT_EQ(emcy_history(context_, "hall:own"), kDone) << err_.str();
  EXPECT_THAT(out_.str(), testing::StartsWith("hall:127 own, 2 errors in 1003h\n  6000  "));
  EXPECT_THAT(gateway_.asked, testing::Each(0));
}

TEST_F(StoredErrorHistory, AsJson) {
  context_.json = true;
  EXPECT_EQ(emcy_history(context_, "hall"), kDone);
  const auto json = nlohmann::json::parse(out_.str());
  EXPECT_EQ(json["nodes"][0]["errors"][0]["code"], 0x6000);
  EXPECT_EQ(json["nodes"][0]["errors"][0]["additional"], 0x1234);
  EXPECT_TRUE(json["nodes"][0]["stored"]);
  EXPECT_FALSE(json["nodes"][1]["stored"]);
}

}  // namespace
}  // namespace linegate::console
