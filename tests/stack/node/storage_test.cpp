// SPDX-License-Identifier: Apache-2.0
// 1010h, 1011h and 1020h of a whole node: over SDO, at resets and at power-on.
#include "stack/storage/storage.h"

#include "stack/storage/medium.h"
#include "stack/storage/parameters.h"

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using storage::kLoad;
using storage::kSave;

class StoringNodeTest : public NodeTest {
 protected:
  StoringNodeTest() { make(); }

  // Switches a device on, with the content of the medium.
  void make(std::uint8_t node_id = kNodeId) {
    node = std::make_unique<Node>(dictionary(), Options{node_id, false, true}, events, nullptr);
    node->set_medium(&medium);
  }

  static od::Dictionary dictionary() {
    using enum od::DataType;
    od::Dictionary out = example_dictionary();
    (void)out.add(testing::array(0x1010, unsigned32, 4)).ok();
    (void)out.add(testing::array(0x1011, unsigned32, 4)).ok();
    (void)out.add(testing::array(0x1020, unsigned32, 2)).ok();
    (void)out.add(testing::object(0x2100, unsigned16, 7)).ok();
    for (const od::Address address :
         {od::Address{0x1017, 0}, od::Address{0x1020, 1}, od::Address{0x1020, 2},
          od::Address{0x1801, 1}, od::Address{0x2100, 0}}) {
      (void)out.set_store(address, true).ok();
    }
    return out;
  }

  storage::MemoryMedium medium;
};

TEST_F(StoringNodeTest, ParametersSavedOverSdoAreThereAtPowerOn) {
  boot();
  EXPECT_EQ(sdo_write({0x1017, 0}, 2, 50), 0U);
  EXPECT_EQ(sdo_write({0x2100, 0}, 2, 8), 0U);
  EXPECT_EQ(sdo_write({0x2000, 1}, 2, 9), 0U);
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), 0U);

  make();
  node->start(at(0ms));
  EXPECT_EQ(number(0x1017, 0), 50U);
  EXPECT_EQ(number(0x2100, 0), 8U);
  EXPECT_EQ(number(0x2000, 1), 0x1111U) << "not marked to be stored";
  // The services use the stored values: a boot-up message, and the first heartbeat after 50 ms.
  EXPECT_EQ(drain(at(0ms)), (std::vector<Sent>{{at(0ms), 0x705, {0}}}));
  EXPECT_EQ(advance(50ms), (std::vector<Sent>{{at(50ms), 0x705, {0x7F}}}));
}

TEST_F(StoringNodeTest, TheSameNodeAfterPowerOffHasThemToo) {
  boot();
  EXPECT_EQ(sdo_write({0x2100, 0}, 2, 8), 0U);
  EXPECT_EQ(sdo_write({0x1010, 3}, 4, kSave), 0U) << "sub 3: 6000h to 9FFFh";
  EXPECT_EQ(sdo_write({0x1017, 0}, 2, 50), 0U);
  EXPECT_EQ(sdo_write({0x1010, 2}, 4, kSave), 0U);
  node->start(at(10ms));
  EXPECT_EQ(number(0x2100, 0), 7U);
  EXPECT_EQ(number(0x1017, 0), 50U);
}

TEST_F(StoringNodeTest, RefusalsOfTheTwoObjects) {
  boot();
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kLoad), 0x0800'0020U);
  EXPECT_EQ(sdo_write({0x1011, 1}, 4, kSave), 0x0800'0020U);
  node->set_medium(nullptr);
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), 0x0800'0020U);
  EXPECT_EQ(sdo_write({0x1011, 1}, 4, kLoad), 0x0800'0020U);
}

TEST_F(StoringNodeTest, RestoredDefaultsComeWithTheReset) {
  boot();
  EXPECT_EQ(sdo_write({0x1017, 0}, 2, 50), 0U);
  EXPECT_EQ(sdo_write({0x2100, 0}, 2, 8), 0U);
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), 0U);
  EXPECT_EQ(sdo_write({0x1011, 1}, 4, kLoad), 0U);
  EXPECT_EQ(number(0x1017, 0), 50U);
  nmt(0x82);
  EXPECT_EQ(number(0x1017, 0), 0U);
  EXPECT_EQ(number(0x2100, 0), 8U);
  nmt(0x81);
  EXPECT_EQ(number(0x2100, 0), 7U);
}

class SlowMedium final : public storage::Medium {
 public:
  bool read(std::vector<std::byte>& image) override {
    image.clear();
    return true;
  }
  bool keep(std::span<const std::byte> /*image*/) override { return true; }
  bool slow() const override { return true; }
};

TEST_F(StoringNodeTest, TheSdoIsAnsweredWhenASlowMediumIsDone) {
  SlowMedium slow;
  node->set_medium(&slow);
  boot();
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), std::nullopt);
  EXPECT_TRUE(advance(50ms).empty());
  node->medium_done(true);
  EXPECT_LE(node->next_wake(), at(50ms));
  EXPECT_EQ(advance(50ms),
            (std::vector<Sent>{{at(50ms), 0x585, {0x60, 0x10, 0x10, 1, 0, 0, 0, 0}}}));
  EXPECT_EQ(sdo_write({0x1011, 1}, 4, kLoad, 60ms), std::nullopt);
  node->medium_done(false);
  EXPECT_EQ(advance(60ms),
            (std::vector<Sent>{{at(60ms), 0x585, {0x80, 0x11, 0x10, 1, 0, 0, 0x06, 0x06}}}));
  node->set_medium(nullptr);
}

// TPDO 2 uses 285h; it is stored as invalid.
TEST_F(StoringNodeTest, StoredPdoParametersAreThoseOfThePdo) {
  boot();
  EXPECT_EQ(sdo_write({0x1801, 1}, 4, 0x8000'0285), 0U);
  EXPECT_EQ(sdo_write({0x1010, 2}, 4, kSave), 0U);
  EXPECT_EQ(sdo_write({0x1801, 1}, 4, 0x0000'0285), 0U);
  nmt(0x82);
  nmt(0x01);
  drain(at(0ms));
  node->pdos().value_changed({0x2001, 2}, at(1ms));
  EXPECT_TRUE(drain(at(1ms)).empty());
}

TEST_F(StoringNodeTest, WhatCannotBeUsedIsToldOnceAndTheDefaultsAreUsed) {
  boot();
  EXPECT_EQ(sdo_write({0x2100, 0}, 2, 8), 0U);
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), 0U);
  testing::pop_events(events);

  make(6);  // the medium was moved to another device
  node->start(at(0ms));
  EXPECT_EQ(number(0x2100, 0), 7U);
  EXPECT_EQ(number(0x1001, 0), 0x01U);
  // Damage::owner, reported after boot-up.
  EXPECT_EQ(drain(at(0ms)), (std::vector<Sent>{{at(0ms), 0x085, {0x00, 0x63, 0x01, 4, 0, 0, 0, 0}},
                                               {at(0ms), 0x706, {0}}}));
  EXPECT_EQ(kinds(), (std::vector<EventKind>{EventKind::own_state, EventKind::emcy_sent,
                                             EventKind::configuration_error}));
  EXPECT_EQ(number(0x1003, 1), 0x0004'6300U) << "in the history too";
  node->command(nmt::Command::reset_node, at(1ms));
  EXPECT_EQ(number(0x1001, 0), 0U);
  EXPECT_EQ(drain(at(1ms)), (std::vector<Sent>{{at(1ms), 0x706, {0}}}));
}

TEST_F(StoringNodeTest, ParametersThatCannotBeUsedAreAnErrorUntilTheNextReset) {
  boot();
  EXPECT_EQ(sdo_write({0x2100, 0}, 2, 8), 0U);
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), 0U);
  make(6);  // the medium was moved to another device
  node->start(at(0ms));
  EXPECT_FALSE(node->error_free());
  drain(at(0ms));
  node->bus_event({.state = can::BusState::error_passive, .time = at(1ms)});
  EXPECT_EQ(drain(at(1ms)),
            (std::vector<Sent>{{at(1ms), 0x085, {0x20, 0x81, 0x11, 0, 0, 0, 0, 0}}}));
  node->bus_event({.state = can::BusState::error_active, .time = at(2ms)});
  EXPECT_TRUE(drain(at(2ms)).empty()) << "another error remains";
  EXPECT_EQ(number(0x1001, 0), 0x01U);
  node->command(nmt::Command::reset_node, at(3ms));
  EXPECT_TRUE(node->error_free());
}

TEST_F(StoringNodeTest, TheConfigurationDateSurvivesAndIsClearedByAChange) {
  boot();
  EXPECT_EQ(sdo_write({0x1020, 1}, 4, 15'000), 0U);
  EXPECT_EQ(sdo_write({0x1020, 2}, 4, 1), 0U);
  EXPECT_EQ(sdo_write({0x1010, 1}, 4, kSave), 0U);
  make();
  boot();
  const auto date = [this] {
    const auto value = node->dictionary().read({0x1020, 1});
    return value ? load_le(*value) : ~std::uint64_t{0};
  };
  EXPECT_EQ(date(), 15'000U);
  EXPECT_EQ(sdo_write({0x2100, 0}, 2, 8), 0U);
  EXPECT_EQ(date(), 0U);
}

}  // namespace
}  // namespace linegate::node
