// SPDX-License-Identifier: Apache-2.0
// Outputs and the nodes that receive them: sent when a node is started, valid when transmitted.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo::test {
namespace {

using Receiver = Engine::Receiver;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto kOutputs = image::Direction::outputs;
constexpr std::uint32_t kWord = 0x2003'0010;  // 16 bits
constexpr std::uint32_t kByte = 0x2002'0008;

class ReceiversTest : public testing::Test {
 protected:
  RemoteNode receiver(std::uint8_t id, std::vector<Parameters> rpdos) const {
    RemoteNode out;
    out.id = id;
    out.device = &device_;
    out.pdos = {{}, std::move(rpdos)};
    return out;
  }
  static std::vector<std::string> sent(Manager& manager, Instant now) {
    std::vector<std::string> out;
    can::Frame frame;
    while (manager.engine->next_frame(frame, now)) {
      out.push_back(std::to_string(frame.id - 0x200) + ":" +
                    std::to_string(std::to_integer<unsigned>(frame.data[0])));
    }
    return out;
  }
  static void write(Manager& manager, std::uint32_t entry, std::uint64_t value, Instant now) {
    manager.image->write_entry(kOutputs, entry, value);
    const image::Entry& place = manager.plan.outputs.entries[entry];
    manager.engine->outputs_written(place.bit_offset, place.bit_length, false, now);
  }
  static bool valid(const Manager& manager, std::uint32_t entry) {
    return manager.image->is_valid(kOutputs, entry);
  }

  od::DeviceDescription device_ = plain_device();
};

TEST_F(ReceiversTest, ANodeThatIsStartedGetsItsOutputsOnceAlthoughNothingChanged) {
  Manager manager(
      {receiver(5, {remote_pdo(1, 0x205, {kWord})}), receiver(6, {remote_pdo(1, 0x206, {kWord})})});
  write(manager, 0, 7, at(1));
  write(manager, 1, 8, at(1));
  EXPECT_THAT(sent(manager, at(1)), ElementsAre("5:7", "6:8"));
  manager.engine->set_receiver(5, Receiver::started);
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("5:7")) << "not the PDO of node 6";
  manager.engine->set_receiver(5, Receiver::started);
  write(manager, 0, 7, at(3));
  EXPECT_THAT(sent(manager, at(3)), IsEmpty());
  manager.engine->set_receiver(5, Receiver::waiting);
  EXPECT_THAT(sent(manager, at(4)), IsEmpty());
  manager.engine->set_receiver(5, Receiver::started);
  write(manager, 0, 9, at(5));
  EXPECT_THAT(sent(manager, at(5)), ElementsAre("5:9")) << "one frame with the newest value";
}

TEST_F(ReceiversTest, AnOutputIsValidWhenItsNewestValueWasTransmittedToANodeThatIsStarted) {
  Manager manager({receiver(5, {remote_pdo(1, 0x205, {kWord})})});
  manager.engine->set_receiver(5, Receiver::waiting);
  write(manager, 0, 7, at(1));
  EXPECT_TRUE(manager.image->is_known(kOutputs, 0));
  EXPECT_THAT(sent(manager, at(1)), ElementsAre("5:7"));
  EXPECT_FALSE(valid(manager, 0)) << "the node is not started";
  manager.engine->set_receiver(5, Receiver::started);
  EXPECT_FALSE(valid(manager, 0)) << "not transmitted since";
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("5:7"));
  EXPECT_TRUE(valid(manager, 0));
  write(manager, 0, 8, at(3));
  EXPECT_FALSE(valid(manager, 0)) << "the newest value is still to be sent";
  sent(manager, at(3));
  EXPECT_TRUE(valid(manager, 0));
  manager.engine->set_receiver(5, Receiver::waiting);
  EXPECT_FALSE(valid(manager, 0));
  EXPECT_TRUE(manager.image->is_known(kOutputs, 0));
}

TEST_F(ReceiversTest, ReceiversOfUnknownStateAreTakenAsReady) {
  Manager manager({receiver(5, {remote_pdo(1, 0x205, {kWord})})});
  write(manager, 0, 7, at(1));
  EXPECT_FALSE(valid(manager, 0));
  sent(manager, at(1));
  EXPECT_TRUE(valid(manager, 0));
}

TEST_F(ReceiversTest, OutputsToANodeOfWhichNothingWasReceivedAreSentAndNotValid) {
  Manager manager({receiver(5, {remote_pdo(1, 0x205, {kWord})})});
  write(manager, 0, 7, at(1));
  sent(manager, at(1));
  EXPECT_TRUE(valid(manager, 0));
  manager.engine->set_receiver(5, Receiver::unheard);
  EXPECT_FALSE(valid(manager, 0));
  manager.engine->set_operational(false, at(2));
  manager.engine->set_operational(true, at(2));
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("5:7"));
  EXPECT_FALSE(valid(manager, 0));
  manager.engine->set_receiver(5, Receiver::started);
  EXPECT_THAT(sent(manager, at(3)), ElementsAre("5:7"));
  EXPECT_TRUE(valid(manager, 0));
}

TEST_F(ReceiversTest, ATpdoIsHeldBackForANodeThatIsStartedToo) {
  Manager manager({receiver(5, {remote_pdo(1, 0x205, {kWord, kByte})})});
  manager.engine->set_receiver(5, Receiver::waiting);
  write(manager, 0, 7, at(1));
  manager.engine->set_receiver(5, Receiver::started);
  EXPECT_THAT(sent(manager, at(2)), IsEmpty());
  write(manager, 1, 0, at(3));
  EXPECT_THAT(sent(manager, at(3)), ElementsAre("5:7"));
}

TEST_F(ReceiversTest, NothingIsSentOnEnteringOperationalToNodesThatAreNotStarted) {
  Manager manager(
      {receiver(5, {remote_pdo(1, 0x205, {kWord})}), receiver(6, {remote_pdo(1, 0x206, {kWord})})});
  manager.engine->set_operational(false, at(1));
  manager.engine->set_receiver(5, Receiver::waiting);
  manager.engine->set_receiver(6, Receiver::started);
  manager.image->write_entry(kOutputs, 0, 1);
  manager.image->write_entry(kOutputs, 1, 2);
  manager.engine->set_operational(true, at(2));
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("6:2"));
  manager.engine->set_receiver(5, Receiver::started);
  EXPECT_THAT(sent(manager, at(3)), ElementsAre("5:1"));
}

TEST_F(ReceiversTest, InhibitTimeAndSyncAreKeptAtAStart) {
  Parameters slow = remote_pdo(1, 0x205, {kWord});
  slow.inhibit = std::chrono::milliseconds(10);
  Manager manager({receiver(5, {slow}), receiver(6, {remote_pdo(1, 0x206, {kWord}, 0)})});
  write(manager, 0, 7, at(1));
  EXPECT_THAT(sent(manager, at(1)), ElementsAre("5:7"));
  write(manager, 1, 8, at(1));
  manager.engine->sync(0, at(2));
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("6:8"));
  manager.engine->set_receiver(5, Receiver::started);
  manager.engine->set_receiver(6, Receiver::started);
  EXPECT_THAT(sent(manager, at(3)), IsEmpty());
  manager.engine->sync(0, at(4));
  EXPECT_THAT(sent(manager, at(4)), ElementsAre("6:8"));
  manager.engine->sync(0, at(5));
  EXPECT_THAT(sent(manager, at(5)), IsEmpty());
  manager.engine->advance(at(11));
  EXPECT_THAT(sent(manager, at(11)), ElementsAre("5:7"));
}

TEST_F(ReceiversTest, AValueThatCameAfterTheSampleOfSyncIsNotValid) {
  Manager manager({receiver(5, {remote_pdo(1, 0x205, {kWord, kByte}, 1)})});
  write(manager, 0, 1, at(1));
  write(manager, 1, 1, at(1));
  manager.engine->sync(0, at(2));
  write(manager, 0, 2, at(2));
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("5:1"));
  EXPECT_FALSE(valid(manager, 0)) << "the frame carried the value before";
  manager.engine->sync(0, at(3));
  EXPECT_THAT(sent(manager, at(3)), ElementsAre("5:2"));
  EXPECT_TRUE(valid(manager, 0) && valid(manager, 1));
}

TEST_F(ReceiversTest, APdoThatTwoNodesReceiveIsSentWhenEitherIsStarted) {
  Manager manager(
      {receiver(5, {remote_pdo(1, 0x205, {kWord})}), receiver(6, {remote_pdo(1, 0x205, {kWord})})});
  write(manager, 0, 7, at(1));
  sent(manager, at(1));
  manager.engine->set_receiver(6, Receiver::started);
  EXPECT_THAT(sent(manager, at(2)), ElementsAre("5:7"));
  EXPECT_TRUE(valid(manager, 0));
}

}  // namespace
}  // namespace linegate::pdo::test
