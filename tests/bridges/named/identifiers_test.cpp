// SPDX-License-Identifier: Apache-2.0
// The rule for identifiers in bridges/named/README.md.
#include "bridges/named/identifiers.h"

#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace linegate::named {
namespace {

struct Row {
  std::string_view name;
  std::string_view identifier;
};

// The table of the rule.
constexpr Row kRule[] = {
    // Letters and digits of ASCII stay as they are.
    {"Statusword", "Statusword"},
    {"Q2", "Q2"},
    // Everything between them is one underscore; before and behind them it is omitted.
    {"Read input 8-bit.Input 01", "Read_input_8_bit_Input_01"},
    {"Position in PDO 2", "Position_in_PDO_2"},
    {"Position #2", "Position_2"},
    {"COB-ID 181h", "COB_ID_181h"},
    {"a__b", "a_b"},
    {"_hidden_", "hidden"},
    {"  (Motor)  ", "Motor"},
    {"Druck \xC3\xBC ber", "Druck_ber"},
    {std::string_view("a\0b", 3), "a_b"},
    {"a\\\n*/b", "a_b"},
    // A digit at the begin has an n before it.
    {"24V supply", "n24V_supply"},
    {"-3", "n3"},
    // Reserved words, in any case, have an underscore behind them.
    {"long", "long_"},
    {"Long", "Long_"},
    {"class", "class_"},
    {"Home", "Home_"},
    {"TRUE", "TRUE_"},
    {"None", "None_"},
    {"linux", "linux_"},
    {"co-await", "co_await_"},
    {"isKeyDefined", "isKeyDefined_"},
    {"uint8", "uint8_"},
    {"yield", "yield_"},
    {"abstract", "abstract_"},
    {"longer", "longer"},
    // Without a letter or digit there is none.
    {"", ""},
    {"---", ""},
    {"\xC3\xBC", ""},
};

TEST(Identifiers, FollowTheTableOfTheRule) {
  for (const Row& row : kRule) {
    EXPECT_EQ(identifier_of(row.name), row.identifier) << row.name;
  }
}

TEST(Identifiers, AnIdentifierStaysAsItIs) {
  for (const Row& row : kRule) {
    const std::string once = identifier_of(row.name);
    EXPECT_EQ(is_identifier(once), !once.empty()) << once;
  }
  for (const std::string_view text : {"", "a b", "_a", "a_", "2a", "long", "a__b"}) {
    EXPECT_FALSE(is_identifier(text)) << text;
  }
}

TEST(Identifiers, CollideIfTheyDifferInCaseAlone) {
  Identifiers scope;
  EXPECT_EQ(scope.add("Speed", "axis.Speed"), std::nullopt);
  EXPECT_EQ(scope.add("Speed_2", "axis.Speed 2"), std::nullopt);
  EXPECT_EQ(scope.add("Speed", "axis.Speed!"), "axis.Speed");
  EXPECT_EQ(scope.add("SPEED", "axis.SPEED"), "axis.Speed");
  EXPECT_EQ(scope.add("speed_2", "axis.speed-2"), "axis.Speed 2");
  EXPECT_EQ(scope.add("Spee", "axis.Spee"), std::nullopt);
}

// Generated code has a private member m_speed and a function speed() for a member speed.
TEST(Identifiers, CollideWithThoseOfGeneratedCode) {
  Identifiers scope;
  EXPECT_EQ(scope.add("Speed", "axis.Speed"), std::nullopt);
  EXPECT_EQ(scope.add("m_Speed", "axis.m Speed"), "axis.Speed");
  EXPECT_EQ(scope.add("m_Torque", "axis.m Torque"), std::nullopt);
  EXPECT_EQ(scope.add("Torque", "axis.Torque"), "axis.m Torque");
}

}  // namespace
}  // namespace linegate::named
