// SPDX-License-Identifier: Apache-2.0
// The value history allocates nothing per snapshot and per value.
#include <gtest/gtest.h>

#include "gateway/publish/value_sampler.h"

#include "tests/bench/allocations.h"

namespace linegate::gateway {
namespace {

TEST(ValueSamplerAllocations, NoneForSnapshotsAndValues) {
  using namespace std::chrono_literals;
  ValueSampler::Layouts layouts;
  layouts[0].id = 1;
  layouts[0].entries = {{.bit_length = 8, .type = od::DataType::unsigned8, .name = "inlet.A"}};
  config::History plan;
  plan.entries = {{image::Direction::inputs, 5, "inlet.A"}};
  ValueSampler of(plan, "press", layouts);
  image::Snapshot snapshot;
  snapshot.bytes = {std::byte{0}};
  std::uint64_t stored = 0;
  const auto store = [&](const StoredValue& value) {
    return value.entry != nullptr && ++stored > 0;
  };
  const std::uint64_t before = bench::allocations();
  snapshot.valid = {1};
  const std::uint64_t of_the_test = bench::allocations() - before;
  EXPECT_GT(of_the_test, 0U) << "allocations are counted";
  for (int i = 0; i < 1000; ++i) {
    const Instant now = Instant(10s) + i * 300ms;
    snapshot.acquired = now;
    snapshot.bytes[0] = static_cast<std::byte>(i);
    snapshot.valid[0] = i % 7 == 0 ? 0 : 1;
    of.add(snapshot);
    of.store_due(now, {1h, ClockQuality::synchronised}, store);
  }
  EXPECT_EQ(bench::allocations() - before, of_the_test);
  EXPECT_GT(stored, 300U);
}

}  // namespace
}  // namespace linegate::gateway
