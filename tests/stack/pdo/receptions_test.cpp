// SPDX-License-Identifier: Apache-2.0
// PDOs of which the application receives every reception.
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"
#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;

// Three devices with a TPDO each, of type 255, 1 and 255: an octet and a word after a dummy octet.
class Receptions : public testing::Test {
 protected:
  // queues: queue length of each device.
  Manager& manager(const std::vector<std::uint32_t>& queues) {
    std::vector<RemoteNode> nodes;
    for (std::uint8_t id = 1; id <= 3; ++id) {
      RemoteNode node;
      node.id = id;
      node.device = &device_;
      const std::uint8_t type = id == 2 ? 1 : 255;
      node.pdos.tpdos = {remote_pdo(4, 0x180U + id, {0x20020008, 0x00050008, 0x20030010}, type)};
      nodes.push_back(node);
    }
    manager_ = std::make_unique<Manager>(nodes);
    for (std::size_t i = 0; i < queues.size(); ++i) {
      manager_->plan.rpdos[i].queue = queues[i];
    }
    manager_->engine->link(manager_->plan);
    EXPECT_TRUE(manager_->engine->configure().empty());
    return *manager_;
  }
  void come(std::uint8_t id, std::uint8_t value, int ms) {
    manager_->receive(frame(0x180U + id, {value, 0xEE, 0x34, value}, at(ms)));
  }
  std::vector<Reception> taken() {
    std::vector<Reception> out;
    for (Reception reception; manager_->engine->pop_reception(reception);) {
      out.push_back(reception);
    }
    return out;
  }
  static int first_value(const Reception& reception) {
    return std::to_integer<int>(reception.values[0]);
  }

  const od::DeviceDescription device_ = plain_device();
  std::unique_ptr<Manager> manager_;
};

TEST_F(Receptions, EachIsThereInTheOrderOfReceptionWithItsTimeAndValues) {
  manager({128, 0, 128});
  for (int i = 0; i < 100; ++i) {
    come(i % 3 == 2 ? 3 : 1, static_cast<std::uint8_t>(i), i);
    come(2, 0, i);
  }
  const std::vector<Reception> got = taken();
  ASSERT_EQ(got.size(), 100U);
  for (int i = 0; i < 100; ++i) {
    const Reception& reception = got[static_cast<std::size_t>(i)];
    EXPECT_EQ(first_value(reception), i);
    EXPECT_EQ(std::to_integer<int>(reception.values[1]), 0x34) << "without the dummy";
    EXPECT_EQ(std::to_integer<int>(reception.values[2]), i);
    EXPECT_EQ(reception.time, at(i));
    EXPECT_EQ(reception.node, i % 3 == 2 ? 3 : 1);
    EXPECT_EQ(reception.remote_pdo, 4);
    EXPECT_EQ(reception.entries, 2);
    EXPECT_EQ(reception.first_entry, i % 3 == 2 ? 4U : 0U);
    EXPECT_EQ(reception.lost, 0U);
    EXPECT_EQ(reception.layout_id, manager_->plan.inputs.id);
  }
  EXPECT_EQ(manager_->engine->counters().receptions_lost, 0U);
  EXPECT_EQ(manager_->engine->counters().received, 100U) << "each also counts as received";
}

TEST_F(Receptions, AFullQueueKeepsTheNewestAndCountsTheOthers) {
  manager({8, 0, 128});
  for (int i = 0; i < 100; ++i) {
    come(1, static_cast<std::uint8_t>(i), 2 * i);
    come(3, static_cast<std::uint8_t>(i), 2 * i + 1);
  }
  const std::vector<Reception> got = taken();
  ASSERT_EQ(got.size(), 108U);
  int next = 92;
  Instant last{};
  for (const Reception& reception : got) {
    EXPECT_GT(reception.time, last);
    last = reception.time;
    if (reception.node == 1) {
      EXPECT_EQ(reception.lost, next == 92 ? 92U : 0U);
      EXPECT_EQ(first_value(reception), next++);
    }
  }
  EXPECT_EQ(next, 100);
  EXPECT_EQ(manager_->engine->counters().receptions_lost, 92U);
}

TEST_F(Receptions, AQueueOfOneHasTheNewest) {
  manager({1, 0, 1});
  for (int i = 0; i < 5; ++i) {
    come(1, static_cast<std::uint8_t>(i), i);
  }
  come(3, 9, 7);
  const std::vector<Reception> got = taken();
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(first_value(got[0]), 4);
  EXPECT_EQ(got[0].lost, 4U);
  EXPECT_EQ(first_value(got[1]), 9);
}

TEST_F(Receptions, ThoseOfASynchronousPdoAreThereBeforeTheSync) {
  manager({0, 16, 0});
  come(2, 1, 10);
  come(2, 2, 20);
  std::vector<Reception> got = taken();
  ASSERT_EQ(got.size(), 2U);
  EXPECT_EQ(got[0].time, at(10));
  EXPECT_EQ(first_value(got[1]), 2);
  manager_->engine->sync(0, at(30));
  EXPECT_TRUE(taken().empty());
  EXPECT_EQ(std::to_integer<int>(manager_->snapshot().bytes[4]), 2) << "in the image after SYNC";
}

TEST_F(Receptions, NoneOfAFrameThatIsNotTakenOver) {
  manager({16, 16, 16});
  manager_->receive(frame(0x181, {1, 2}, at(1)));  // too short
  EXPECT_TRUE(taken().empty());
  manager_->receive(frame(0x181, {1, 2, 3, 4, 5}, at(2)));  // too long: its first bytes are used
  EXPECT_EQ(taken().size(), 1U);
  manager_->engine->set_operational(false, at(3));
  come(1, 1, 4);
  EXPECT_TRUE(taken().empty());
}

TEST_F(Receptions, ReadingTheRecordsAgainKeepsThoseThatWait) {
  manager({16, 0, 0});
  come(1, 1, 1);
  EXPECT_TRUE(manager_->engine->configure().empty());
  come(1, 2, 2);
  EXPECT_EQ(taken().size(), 2U);
  come(1, 3, 3);
  manager_->engine->drop_receptions();
  EXPECT_TRUE(taken().empty());
  EXPECT_EQ(manager_->engine->counters().receptions_lost, 1U);
}

}  // namespace
}  // namespace linegate::pdo
