// SPDX-License-Identifier: Apache-2.0
// PDOs whose every reception is passed on.
#include <gtest/gtest.h>

#include "tests/gateway/runtime/line_runner_fixture.h"

namespace linegate::gateway {
namespace {

constexpr const char* kEveryReception = R"(schema: 1
lines:
  - name: a
    interface: virtual:a
    reset_nodes: true
    sdo_timeout: 50ms
    access: all
    publish: {on_change: {min_separation: 10ms}}
    nodes:
      - id: 5
        name: io
        eds: bridges/sim/eds/digital-io.eds
        check_identity: false
        pdos: {tpdo1: {every: true, queue: 16}}
)";

class EveryReceptionTest : public LineRunnerTest {
 protected:
  EveryReceptionTest() : LineRunnerTest(kEveryReception) {}

  std::size_t room() const { return room_for_receptions(plan().config); }
  std::vector<pdo::Reception> taken() {
    std::vector<pdo::Reception> out;
    for (pdo::Reception reception; port_.receptions.pop(reception);) {
      out.push_back(reception);
    }
    return out;
  }
};

TEST_F(EveryReceptionTest, FramesOfOnePublicationPeriodAreHandedOverOneByOne) {
  boot();
  (void)taken();
  for (int i = 0; i < 100; ++i) {
    come(0x185, {static_cast<std::uint8_t>(i), 2, 3, 4});
    serve(10us);
  }
  const std::vector<pdo::Reception> got = taken();
  ASSERT_EQ(got.size(), 100U);
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(std::to_integer<std::size_t>(got[i].values[0]), i);
    EXPECT_EQ(got[i].time, now_ - 10us * (100 - i));
  }
}

// 16 receptions are queued in the line, and as many as the ring holds behind it.
TEST_F(EveryReceptionTest, WithoutAReaderTheNewestWaitAndTheOthersAreCounted) {
  boot();
  (void)taken();
  const std::size_t most = room() + 16;
  for (std::size_t i = 0; i < most + 20; ++i) {
    come(0x185, {static_cast<std::uint8_t>(i), 0, 0, 0});
    serve(10us);
  }
  EXPECT_EQ(runner_->line().state().counters.receptions_lost, 20U);
  ASSERT_EQ(taken().size(), room());
  EXPECT_LE(runner_->next_wake(), now_ + 1ms) << "the remaining receptions follow soon";
  serve(1ms);
  const std::vector<pdo::Reception> rest = taken();
  ASSERT_EQ(rest.size(), 16U);
  EXPECT_EQ(rest[0].lost, 20U);
  EXPECT_EQ(std::to_integer<std::uint8_t>(rest[15].values[0]),
            static_cast<std::uint8_t>(most + 19));
}

class WithoutQueues : public LineRunnerTest {};

TEST_F(WithoutQueues, NoReceptionIsHandedOver) {
  boot();
  come(0x185, {1, 2, 3, 4});
  serve(20ms);
  pdo::Reception reception;
  EXPECT_FALSE(port_.receptions.pop(reception));
}

}  // namespace
}  // namespace linegate::gateway
