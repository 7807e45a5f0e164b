// SPDX-License-Identifier: Apache-2.0
// OutputWrite of a gateway with DDS-Security: an identity without a right to a line neither writes
// its outputs nor suppresses those who do.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "tests/gateway/security/secured_plant.h"

namespace linegate::gateway {
namespace {

using OutputWriter = GroupWriter<v1::OutputWritePubSubType>;

class OutputRights : public SecuredPlant {
 protected:
  OutputRights() : SecuredPlant("") {}

  std::unique_ptr<OutputWriter> make(const std::string& name, std::uint32_t strength,
                                     const std::vector<std::string>& partitions) {
    return std::make_unique<OutputWriter>(v1::TOPIC_OUTPUT_WRITE, name, strength, partitions,
                                          identity(name));
  }
  // The outputs of press belong to olga, whatever the stranger sends.
  void expect_no_effect(OutputWriter& stranger) {
    const auto owner =
        matched([&] { return make("olga", kStrength, {"test/press/operator/olga"}); });
    ASSERT_NE(owner, nullptr);
    ASSERT_TRUE(until([&] { return seen_.layouts.contains("press/outputs"); }));
    owner->sample.layout_id(seen_.layouts["press/outputs"].id);
    EXPECT_TRUE(until([&] {
      stranger.write();
      owner->write();
      return state().applied > 10 && state().owner == "olga";
    })) << state().applied
        << " applied, " << state().refused << " refused, owner \"" << state().owner << '"';
  }
};

// Samples of press in the own partition, with a greater ownership strength: the reader arbitrates
// before the gateway checks the right.
TEST_F(OutputRights, AnOperatorOfAnotherLineDoesNotSuppressTheOwner) {
  const auto stranger =
      matched([&] { return make("dora", kStrength + 1, {"test/device/operator/dora"}); });
  ASSERT_NE(stranger, nullptr);
  EXPECT_TRUE(until([&] {
    stranger->write();
    return state().refused > 0;
  }));
  expect_no_effect(*stranger);
}

// Only one of its partitions is permitted.
TEST_F(OutputRights, APartitionThatIsNotPermittedDoesNotHideBehindOneThatIs) {
  const auto stranger =
      make("dora", kStrength + 1, {"test/device/operator/dora", "test/press/operator/dora"});
  expect_no_effect(*stranger);
  EXPECT_EQ(state().refused, 0U);
}

}  // namespace
}  // namespace linegate::gateway
