// SPDX-License-Identifier: Apache-2.0
#include "bridges/request/request.h"

#include <set>

#include <gtest/gtest.h>

namespace linegate::request {
namespace {

TEST(Request, EachNumberOfTheContractHasAKindAndAName) {
  std::set<std::string_view> names;
  for (std::uint8_t number = 0; number < kCommandKinds; ++number) {
    const auto empty = empty_request(number);
    ASSERT_TRUE(empty) << unsigned{number};
    EXPECT_EQ(static_cast<unsigned>(kind(*empty)), number);
    EXPECT_NE(command_name(kind(*empty)), "unknown") << unsigned{number};
    EXPECT_TRUE(names.insert(command_name(kind(*empty))).second) << command_name(kind(*empty));
  }
}

TEST(Request, OtherNumbersHaveNone) {
  for (unsigned number = kCommandKinds; number <= 0xFF; ++number) {
    EXPECT_FALSE(empty_request(static_cast<std::uint8_t>(number))) << number;
    EXPECT_EQ(command_name(static_cast<line::CommandKind>(number)), "unknown") << number;
  }
}

TEST(Request, TheGatewayExecutesFourKinds) {
  for (const std::uint8_t number : std::initializer_list<std::uint8_t>{7, 10, 13, 26}) {
    const auto empty = empty_request(number);
    ASSERT_TRUE(empty);
    EXPECT_TRUE(std::holds_alternative<GatewayRequest>(*empty)) << unsigned{number};
  }
  EXPECT_EQ(command_name(kind(GatewayRequest(Versions{}))), "versions");
  EXPECT_EQ(command_name(kind(GatewayRequest(BusRestart{}))), "bus-restart");
  EXPECT_EQ(command_name(kind(GatewayRequest(BusFault{}))), "bus-fault");
  EXPECT_EQ(command_name(kind(GatewayRequest(JournalRead{}))), "journal-read");
  EXPECT_EQ(command_name(line::CommandKind::sdo_read), "sdo-read");
}

}  // namespace
}  // namespace linegate::request
