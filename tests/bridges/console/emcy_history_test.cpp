// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/emcy_history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

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
    listener.on_line(kEmcyLine, line);
    NodeView silent{.name = "belt"};
    silent.state.node = 4;
    listener.on_node(kEmcyLine, silent);
    NodeView loud{.name = "axis"};
    loud.state.node = 5;
    loud.state.emcy_count = 2;
    listener.on_node(kEmcyLine, loud);
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    asked.push_back(command);
    return answer;
  }

  std::vector<line::Command> asked;
  Answer answer;
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
  EXPECT_EQ(emcy_history(context_, "hall:own"), kUsage);
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

}  // namespace
}  // namespace linegate::console
