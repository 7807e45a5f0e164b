// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/report.h"

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/gateway/doctor/seen.h"

namespace linegate::doctor {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

const Findings kFound{{"firewall", {"one", "two"}, "means", "do this"}};

TEST(Report, InWords) {
  std::ostringstream sound;
  print_report(sound, sound_plant(), {});
  EXPECT_THAT(sound.str(), HasSubstr("DDS domain 7, without security, profile profiles.xml"));
  EXPECT_THAT(sound.str(), HasSubstr("interface eth0 10.0.0.2 with multicast"));
  EXPECT_THAT(sound.str(), HasSubstr("gateway 'hall' is received, with 1 line"));
  EXPECT_THAT(sound.str(), EndsWith("no fault was found\n"));
  std::ostringstream broken;
  print_report(broken, sound_plant(), kFound);
  EXPECT_THAT(broken.str(), EndsWith("1. firewall\n   seen:  one\n   seen:  two\n"
                                     "   means: means\n   do:    do this\n"));
}

TEST(Report, AsJson) {
  Observations seen = sound_plant();
  seen.heard.front().announcement.name = "linegate \x1b\xff";
  const std::string text = report_json(seen, kFound);
  EXPECT_THAT(text, Not(HasSubstr("\n")));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["domain"], 7);
  EXPECT_EQ(json["fault"], true);
  EXPECT_EQ(json["findings"][0]["cause"], "firewall");
  EXPECT_EQ(json["findings"][0]["seen"].size(), 2U);
  EXPECT_EQ(json["gateways"][0]["gateway"], "hall");
}

}  // namespace
}  // namespace linegate::doctor
