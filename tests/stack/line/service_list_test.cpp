// SPDX-License-Identifier: Apache-2.0
// The list of the services of a line: each reports itself to its host.
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ServiceListTest, HasTheServicesInTheOrderOfTheirCreation) {
  RecordingHost host;
  EXPECT_THAT(host.services(), IsEmpty());
  const ServiceStub first(host);
  std::optional<ServiceStub> second(std::in_place, host);
  const ServiceStub third(host);
  EXPECT_THAT(host.services(), ElementsAre(&first, &*second, &third));
  second.reset();
  EXPECT_THAT(host.services(), ElementsAre(&first, &third));
}

}  // namespace
}  // namespace linegate::line
