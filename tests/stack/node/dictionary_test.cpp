// SPDX-License-Identifier: Apache-2.0
// Hooks of a node that complete later, and objects that are added and removed.
#include <gmock/gmock.h>

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Slow : public od::Hook {
 public:
  AbortCode check_write(od::Address, std::span<const std::byte>) override { return od::kLater; }
  void put_off(od::Address, od::Ticket number) override { ticket = number; }
  void cancelled(od::Ticket) override { ++given_up; }

  od::Ticket ticket = 0;
  int given_up = 0;
};

class LaterNodeTest : public NodeTest {
 protected:
  LaterNodeTest() {
    boot_and_start();
    EXPECT_TRUE(node->dictionary().add_hook(0x2001, slow));
    EXPECT_EQ(sdo_write({0x2001, 1}, 2, 0x4321), std::nullopt) << "no answer yet";
  }

  Slow slow;
};

TEST_F(LaterNodeTest, OtherServicesGoOnWhileAnSdoServerWaits) {
  hear(1ms, 0x205, {0x34, 0x12});
  EXPECT_EQ(number(0x2000, 1), 0x1234U);
  hear(2ms, 0x080, {});
  EXPECT_THAT(drain(at(2ms)), ElementsAre(Sent{at(2ms), 0x185, {0x11, 0x11}}));
  EXPECT_THAT(advance(3ms), IsEmpty());

  ASSERT_TRUE(node->dictionary().complete(slow.ticket, AbortCode::none));
  EXPECT_LE(node->next_wake(), at(3ms));
  EXPECT_THAT(advance(3ms), ElementsAre(Sent{at(3ms), 0x585, {0x60, 0x01, 0x20, 1, 0, 0, 0, 0}}));
  EXPECT_EQ(number(0x2001, 1), 0x4321U);
}

TEST_F(LaterNodeTest, LeavingTheStatesThatServeSdoEndsTheWaiting) {
  nmt(0x02, kNodeId, 1ms);
  EXPECT_EQ(slow.given_up, 1);
  EXPECT_FALSE(node->dictionary().complete(slow.ticket, AbortCode::none));
  EXPECT_THAT(advance(2ms), IsEmpty());
  EXPECT_EQ(number(0x2001, 1), 0x1111U);
}

TEST_F(LaterNodeTest, AResetEndsTheWaiting) {
  nmt(0x81, kNodeId, 1ms);
  EXPECT_EQ(slow.given_up, 1);
}

TEST_F(NodeTest, APdoWhoseObjectIsRemovedIsAConfigurationErrorAndStops) {
  boot_and_start();
  ASSERT_TRUE(node->dictionary().remove(0x2001));
  const std::vector<Event> events_now = testing::pop_events(events);
  ASSERT_EQ(events_now.size(), 2U);
  for (const Event& event : events_now) {
    EXPECT_EQ(event.node, kNodeId);
    EXPECT_EQ(std::get<event::ConfigurationError>(event.data).abort, AbortCode::no_object);
  }
  hear(1ms, 0x080, {});
  EXPECT_THAT(advance(1ms), IsEmpty());
  EXPECT_EQ(sdo_write({0x2001, 1}, 2, 1, 1ms), 0x0602'0000U);
}

TEST_F(NodeTest, AnObjectAddedAtRunTimeIsServedLikeAnyOther) {
  boot_and_start();
  using enum od::DataType;
  ASSERT_TRUE(node->dictionary().add(
      testing::record(0x2100, {testing::sub(0, unsigned8, 1, od::Access::constant),
                               testing::sub(1, unsigned16, 7, od::Access::rw, true)})));
  EXPECT_EQ(sdo_write({0x2100, 1}, 2, 0x1234), 0U);
  EXPECT_EQ(sdo_write({0x1801, 1}, 4, 0x8000'0285), 0U);
  EXPECT_EQ(sdo_write({0x1A01, 0}, 1, 0), 0U);
  EXPECT_EQ(sdo_write({0x1A01, 1}, 4, 0x2100'0110), 0U);
  EXPECT_EQ(sdo_write({0x1A01, 0}, 1, 1), 0U);
  others.clear();
  EXPECT_EQ(sdo_write({0x1801, 1}, 4, 0x0000'0285, 2ms), 0U);
  EXPECT_THAT(others, ElementsAre(Sent{at(2ms), 0x285, {0x34, 0x12}}));
}

}  // namespace
}  // namespace linegate::node
