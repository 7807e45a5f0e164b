// SPDX-License-Identifier: Apache-2.0
// Named topics of a gateway with DDS-Security: what each identity reads, and whose samples have an
// effect. Participants do not check their own permissions (unchecked_permissions.cpp).
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/security/secured_plant.h"

namespace linegate::gateway {
namespace {

constexpr int kSamplesOfStrangers = 100;

class NamedRights : public SecuredPlant {
 protected:
  NamedRights() : SecuredPlant(", written_by: named") {}

  std::unique_ptr<SetWriter> writer(const std::string& name, const std::string& partition) {
    return matched(
        [&] { return std::make_unique<SetWriter>(name, kStrength, partition, identity(name)); });
  }
  std::unique_ptr<NamedReader<OutputsType>> reader(const std::string& name) {
    for (int attempt = 0; attempt < kAttemptsToJoin; ++attempt) {
      auto made = std::make_unique<NamedReader<OutputsType>>(
          "plant/press/every/outputs", fast::TRANSIENT_LOCAL_DURABILITY_QOS, identity(name));
      const auto arrived = [&] {
        made->take();
        return made->first != 0;
      };
      if (until(arrived, kOneAttemptToJoin))
        return made;
    }
    ADD_FAILURE() << name << " receives nothing";
    return nullptr;
  }
};

TEST_F(NamedRights, AValueOfAnOperatorOrEngineerIsAppliedAndReadByAViewer) {
  const auto outputs = reader("victor");
  ASSERT_NE(outputs, nullptr);
  int value = 200;
  for (const auto& [name, right] : {std::pair("olga", "operator"), std::pair("erin", "engineer")}) {
    const auto plc = writer(name, "test/press/" + std::string(right) + "/" + name);
    ASSERT_NE(plc, nullptr);
    ++value;
    plc->sample.values().every_Set_24V_supply(static_cast<std::uint8_t>(value));
    plc->sample.given().every_Set_24V_supply(true);
    EXPECT_TRUE(until([&] {
      plc->write();
      outputs->take();
      return outputs->sample.values().Set_24V_supply() == value && state().owner == name;
    })) << name
        << ": " << state().owner;
  }
  EXPECT_EQ(state().refused, 0U);
}

// A viewer, an operator of another line, and one who claims to be another. Their samples would win,
// and their own libraries would send them, but the gateway does not match their writers.
TEST_F(NamedRights, WhoHasNoRightToTheLineHasNoEffect) {
  std::vector<std::unique_ptr<SetWriter>> strangers;
  for (const auto& [name, partition] : {std::pair("victor", "test/press/viewer/victor"),
                                        std::pair("victor", "test/press/operator/olga"),
                                        std::pair("dora", "test/device/operator/dora"),
                                        std::pair("dora", "test/press/operator/dora"),
                                        std::pair("dora", "test/press/operator/olga")}) {
    strangers.push_back(
        std::make_unique<SetWriter>(name, kStrength + 1, partition, identity(name)));
    strangers.back()->sample.values().every_Set_24V_supply(111);
    strangers.back()->sample.given().every_Set_24V_supply(true);
  }
  const auto plc = writer("olga", "test/press/operator/olga");
  const auto outputs = reader("victor");
  ASSERT_TRUE(plc != nullptr && outputs != nullptr);
  plc->sample.values().every_Set_24V_supply(240);
  plc->sample.given().every_Set_24V_supply(true);
  bool had_effect = false;
  int rounds = 0;
  EXPECT_TRUE(until([&] {
    for (const auto& stranger : strangers)
      stranger->write();
    plc->write();
    outputs->take();
    had_effect = had_effect || outputs->sample.values().Set_24V_supply() == 111;
    return ++rounds > kSamplesOfStrangers && state().owner == "olga" && state().applied > 10;
  }));
  EXPECT_FALSE(had_effect);
  for (const auto& stranger : strangers)
    EXPECT_EQ(stranger->readers(), 0);
  EXPECT_EQ(outputs->sample.values().Set_24V_supply(), 240);
  EXPECT_EQ(state().refused, 0U) << "samples that no permissions allow are not received";
}

// The permissions of this operator allow both lines, each in its own partition.
TEST_F(NamedRights, ASampleInThePartitionOfAnotherLineIsRefused) {
  const auto otto = writer("otto", "test/device/operator/otto");
  ASSERT_NE(otto, nullptr);
  otto->sample.given().every_Set_24V_supply(true);
  EXPECT_TRUE(until([&] {
    otto->write();
    return has_text("its writer has no right to send requests to this line") ||
           state().refusal == line::OutputRefusal::no_right;
  }));
  EXPECT_EQ(state().applied, 0U);
  EXPECT_EQ(state().owner, "");
}

}  // namespace
}  // namespace linegate::gateway
