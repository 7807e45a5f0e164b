// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/plan_difference.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/plans.h"

namespace linegate::config {
namespace {

using Names = std::vector<std::string>;

Plant plant(const std::string& lines, const std::string& rest = "") {
  return gateway::make_plant("schema: 1\n" + rest + "lines:\n" + lines);
}

const std::string kA = "  - {name: a, interface: 'virtual:a', network_id: 1}\n";
const std::string kB = "  - {name: b, interface: 'virtual:b', network_id: 2}\n";
const std::string kC = "  - {name: c, interface: 'virtual:c', network_id: 3}\n";

TEST(PlanDifference, TellsLinesApartByTheirNames) {
  const auto running = identity_of(plant(kA + kB));
  const auto same = difference(running, plant(kB + kA));
  EXPECT_TRUE(same.empty()) << "the order of lines has no effect if they have network-IDs";
  EXPECT_EQ(same.unchanged, (Names{"b", "a"}));
  EXPECT_TRUE(same.refusals.empty());

  const std::string other_b = "  - {name: b, interface: 'virtual:b', network_id: 2, sync: 10ms}\n";
  const auto differs = difference(running, plant(other_b + kC));
  EXPECT_EQ(differs.changed, Names{"b"});
  EXPECT_EQ(differs.started, Names{"c"});
  EXPECT_EQ(differs.stopped, Names{"a"});
  EXPECT_TRUE(differs.unchanged.empty());
  EXPECT_EQ(describe(differs), "lines changed: b; started: c; stopped: a; unchanged: 0");

  const auto renamed =
      difference(running, plant("  - {name: x, interface: 'virtual:a', network_id: 1}\n" + kB));
  EXPECT_EQ(renamed.started, Names{"x"});
  EXPECT_EQ(renamed.stopped, Names{"a"});
}

TEST(PlanDifference, RefusesWhatSubscribersKnowTheGatewayBy) {
  const auto running = identity_of(plant(kA));
  EXPECT_TRUE(difference(running, plant(kA, "gateway: {log: debug}\n")).refusals.empty());
  const auto refused = difference(
      running,
      plant(kA, "gateway: {name: other}\ndds: {domain: 7, security: /proc/self, process: same}\n"));
  ASSERT_EQ(refused.refusals.size(), 3U);
  EXPECT_TRUE(has_errors(refused.refusals));
  EXPECT_NE(refused.refusals[0].text.find("the name of the gateway changes from \"linegate\" to "
                                          "\"other\", which needs a new start"),
            std::string::npos);
}

TEST(PlanDifference, RefusesOtherPartitions) {
  const auto refused = difference(identity_of(plant(kA)), plant(kA, "dds: {partitions: true}\n"));
  ASSERT_EQ(refused.refusals.size(), 1U);
  EXPECT_NE(refused.refusals[0].text.find("the use of partitions changes from \"off\" to \"on\""),
            std::string::npos)
      << refused.refusals[0].text;
}

TEST(PlanDifference, RefusesOtherInterfacesPeersAndFanOut) {
  const auto running = identity_of(plant(kA));
  for (const char* const other :
       {"dds: {interfaces: [eth0]}\n", "dds: {peers: [10.0.0.1]}\n",
        "dds: {discovery_servers: [10.0.0.1]}\n", "dds: {fan_out: multicast}\n"}) {
    EXPECT_EQ(difference(running, plant(kA, other)).refusals.size(), 1U) << other;
  }
}

TEST(PlanDifference, RefusesAnotherIdentityOfTheRoutes) {
  const std::string security = "dds: {security: /proc/self";
  const auto running = identity_of(plant(kA, security + ", routes_security: /proc}\n"));
  EXPECT_TRUE(
      difference(running, plant(kA, security + ", routes_security: /proc}\n")).refusals.empty());
  for (const char* const other : {"}\n", ", routes_security: /proc/self}\n"}) {
    const auto refused = difference(running, plant(kA, security + other));
    ASSERT_EQ(refused.refusals.size(), 1U);
    EXPECT_NE(refused.refusals[0].text.find("the identity of the routes changes from \"/proc\""),
              std::string::npos);
  }
}

// "participants" may be absent: the limit of the profile, or the default, is in effect.
TEST(PlanDifference, ComparesTheNumberOfParticipantsInEffect) {
  const Plant absent = plant(kA);
  const Plant usual = plant(kA, "dds: {participants: 100}\n");
  const Plant other = plant(kA, "dds: {participants: 50}\n");
  EXPECT_TRUE(difference(identity_of(absent), usual).refusals.empty());
  EXPECT_TRUE(difference(identity_of(usual), absent).refusals.empty());
  EXPECT_TRUE(difference(identity_of(absent, 50), other).refusals.empty());
  const auto refused = difference(identity_of(absent), other);
  ASSERT_EQ(refused.refusals.size(), 1U);
  EXPECT_NE(refused.refusals[0].text.find(
                "the number of DDS participants changes from \"100\" to \"50\""),
            std::string::npos)
      << refused.refusals[0].text;
  const auto of_profile = difference(identity_of(other, 30), absent);
  ASSERT_EQ(of_profile.refusals.size(), 1U);
  EXPECT_NE(of_profile.refusals[0].text.find("changes from \"50\" to \"30\""), std::string::npos)
      << of_profile.refusals[0].text;
}

TEST(PlanDifference, RefusesAnotherJournal) {
  const auto running = identity_of(plant(kA, "journal: {file: deploy/j.db, max_age: 2h}\n"));
  EXPECT_TRUE(difference(running, plant(kA, "journal: {file: deploy/j.db, max_age: 120min}\n"))
                  .refusals.empty());
  for (const char* other : {"", "journal: {file: deploy/k.db, max_age: 2h}\n",
                            "journal: {file: deploy/j.db, max_age: 3h}\n",
                            "journal: {file: deploy/j.db, max_age: 2h, values_size: 10MB}\n",
                            "journal: {file: deploy/j.db, max_age: 2h, max_size: 10MB}\n"}) {
    const auto refused = difference(running, plant(kA, other));
    ASSERT_EQ(refused.refusals.size(), 1U) << other;
    EXPECT_TRUE(has_errors(refused.refusals));
    EXPECT_NE(refused.refusals[0].text.find("the journal changes from"), std::string::npos);
  }
}

}  // namespace
}  // namespace linegate::config
