// SPDX-License-Identifier: Apache-2.0
// The parts of a configuration that have no effect on a line in the role observer.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

TEST(Observer, TellsWhatItIgnoresOfItsNodes) {
  const auto loaded = read(R"(schema: 1
lines:
  - name: press
    interface: "simulated:"
    role: observer
    nodes:
      - id: 5
        eds: bridges/sim/eds/drive.eds
        heartbeat: 500ms
        mandatory: true
        store: all
        pdos: {tpdo2: {enabled: false}}
)",
                           paths::in_repository("plant.yaml"));
  ASSERT_TRUE(loaded.ok());
  ASSERT_EQ(loaded.diagnostics.size(), 2U);
  EXPECT_THAT(to_string(loaded.diagnostics[0]),
              testing::HasSubstr("plant.yaml:10:20: warning: mandatory has no effect on an "
                                 "observer, which transmits nothing"));
  EXPECT_THAT(to_string(loaded.diagnostics[1]),
              testing::HasSubstr("plant.yaml:11:16: warning: store has no effect on an observer"));
}

}  // namespace
}  // namespace linegate::config
