// SPDX-License-Identifier: Apache-2.0
// SDO connections between simulated devices, which transfer over them (CiA 302-5).
#include <cstdint>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "stack/can/cob_id.h"
#include "stack/node/sdo_clients.h"

#include "tests/plant/manager_fixture.h"
#include "tests/plant/sdo_channel.h"

namespace linegate::plant {
namespace {

constexpr std::uint8_t kFrom = 5;
constexpr std::uint8_t kTo = 8;
constexpr std::uint32_t kDisabled = 0x8000'0000;

class Connecting : public ManagerFixture {
 protected:
  void SetUp() override {
    config().connection_pool = {0x680, 0x683};
    add(node_of(kFrom, "digital-io"), "digital-io");
    add(node_of(kTo, "drive"), "drive");
  }
  void prepare(sim::Device& device) override {
    for (std::uint16_t i = 0; i < 2; ++i) {
      add_channel(device.dictionary(), static_cast<std::uint16_t>(0x1280 + i));
      add_channel(device.dictionary(), static_cast<std::uint16_t>(0x1201 + i));
    }
    device.node().sdo_clients().configure();
  }
  sim::Device& device(std::uint8_t id) { return *seat().devices.at(id == kFrom ? 0 : 1).device; }
  line::Reply open(Duration timeout = 20s) {
    return wait(execute(
        {.timeout = timeout, .request = line::ConnectionOpen{.node = kFrom, .server = kTo}}));
  }
  line::SdoConnections table() {
    return std::get<line::SdoConnections>(wait(execute({.request = line::ConnectionList{}})).data);
  }
  bool valid(std::uint8_t id, std::uint16_t record) {
    const od::Dictionary& objects = device(id).dictionary();
    return ((*objects.number({record, 1}) | *objects.number({record, 2})) & kDisabled) == 0;
  }
  // Reads an object of kTo by the first SDO client of kFrom.
  std::vector<std::byte> read_over(od::Address address) {
    const auto client = device(kFrom).node().sdo_clients().client(1);
    if (!client.ok()) {
      return {};
    }
    (*client)->read(address, 500ms, world().now(), device(kFrom).node().transmit());
    pass(600ms);
    const auto outcome = (*client)->take();
    return outcome ? outcome->data : std::vector<std::byte>();
  }
};

TEST_F(Connecting, DevicesTransferOverTheConnection) {
  start();
  EXPECT_EQ(read_over({0x1000, 0}), std::vector<std::byte>()) << "not connected";
  ASSERT_TRUE(open().ok());
  ASSERT_EQ(table().size(), 1U);
  EXPECT_EQ(table()[0].state, manager::ConnectionState::open);
  EXPECT_EQ(read_over({0x1000, 0}), number(0x0002'0192)) << "the device type of a drive";
  EXPECT_TRUE(wait(execute({.request = line::ConnectionClose{.number = 1}})).ok());
  EXPECT_EQ(table().size(), 0U);
  EXPECT_EQ(read_over({0x1000, 0}), std::vector<std::byte>()) << "not any more";
}

TEST_F(Connecting, TwoConnectionsUseTheWholePool) {
  start();
  EXPECT_TRUE(open().ok());
  EXPECT_TRUE(open().ok());
  EXPECT_EQ(open().error, to_error(AbortCode::sdo_connection));
  EXPECT_EQ(table().size(), 2U);
  EXPECT_TRUE(valid(kFrom, 0x1280) && valid(kFrom, 0x1281));
}

TEST_F(Connecting, AResetOfEitherReleasesTheOther) {
  start();
  for (const std::uint8_t reset : {kFrom, kTo}) {
    ASSERT_TRUE(open().ok());
    EXPECT_TRUE(
        wait(execute({.request = line::NmtRequest{.node = reset,
                                                  .command = nmt::Command::reset_communication}}))
            .ok());
    pass(2s);
    EXPECT_EQ(table().size(), 0U);
    EXPECT_FALSE(valid(kFrom, 0x1280));
    EXPECT_FALSE(valid(kTo, 0x1201));
  }
}

TEST_F(Connecting, AnAbsentNodeTimesOut) {
  start();
  device(kTo).kill();
  EXPECT_EQ(open().error, to_error(AbortCode::timeout));
  EXPECT_EQ(table().size(), 0U);
}

TEST_F(Connecting, AServerThatDiesIsReleasedWhenItReturns) {
  start();
  ASSERT_TRUE(open().ok());
  device(kTo).kill();
  EXPECT_EQ(wait(execute({.request = line::ConnectionClose{.number = 1}})).error,
            to_error(AbortCode::timeout));
  ASSERT_EQ(table().size(), 1U);
  EXPECT_EQ(table()[0].state, manager::ConnectionState::stale);
  EXPECT_FALSE(valid(kFrom, 0x1280));
  device(kTo).revive(world().now());
  pass(5s);
  EXPECT_EQ(table().size(), 0U);
}

TEST_F(Connecting, ALineThatStopsReleasesItsConnections) {
  start();
  ASSERT_TRUE(open().ok());
  ASSERT_TRUE(open().ok());
  seat().line->stop(world().now());
  EXPECT_TRUE(seat().line->is_ending());
  pass(400ms);
  EXPECT_FALSE(seat().line->is_ending());
  for (std::uint16_t i = 0; i < 2; ++i) {
    EXPECT_FALSE(valid(kFrom, static_cast<std::uint16_t>(0x1280 + i)));
    EXPECT_FALSE(valid(kTo, static_cast<std::uint16_t>(0x1201 + i)));
  }
  EXPECT_EQ(world().failure(), "");
}

// A client over DDS writes no COB-ID of the pool by itself.
TEST_F(Connecting, ThePoolIsOfTheManagerAlone) {
  start();
  const auto write = [this](od::Address address, std::uint32_t cob_id) {
    return wait(execute(
                    {.request =
                         line::SdoWrite{.node = kTo, .address = address, .data = number(cob_id)}}))
        .error;
  };
  const Error refused = to_error(line::Refusal::identifier_in_use);
  EXPECT_EQ(write({0x1201, 1}, 0x681), refused);
  EXPECT_EQ(write({0x1280, 2}, 0x4000'0680), refused);
  EXPECT_EQ(write({0x1014, 0}, 0x682), refused);
  EXPECT_EQ(write({0x1005, 0}, 0x8000'0683), refused);
  EXPECT_EQ(write({0x1201, 1}, 0x684), Error{});
}

}  // namespace
}  // namespace linegate::plant
