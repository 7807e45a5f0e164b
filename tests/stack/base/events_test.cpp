// SPDX-License-Identifier: Apache-2.0
#include "stack/base/events.h"

#include <string>

#include <gtest/gtest.h>

#include "stack/base/event.h"
#include "stack/base/event_members.h"

namespace linegate {
namespace {

class MemberList final : public EventMemberVisitor {
 public:
  void number(std::string_view name, std::uint64_t value) override {
    text += std::string(name) + '=' + std::to_string(value) + ' ';
  }
  void bytes(std::string_view name, std::span<const std::byte> value) override {
    text += std::string(name) + '[' + std::to_string(value.size()) + "] ";
  }

  std::string text;
};

std::string members(const EventData& data) {
  MemberList list;
  visit_members(data, list);
  return list.text;
}

TEST(Events, EmptyDataIsOfItsKind) {
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    const auto wanted = static_cast<EventKind>(i);
    EXPECT_EQ(kind(empty_event_data(wanted)), wanted) << i;
  }
}

TEST(Events, DataOfAnotherKindIsNothing) {
  const Event event{.data = event::FramesLost{7}};
  EXPECT_EQ(event.kind(), EventKind::frames_lost);
  ASSERT_NE(event.get<event::FramesLost>(), nullptr);
  EXPECT_EQ(event.get<event::FramesLost>()->frames, 7U);
  EXPECT_EQ(event.get<event::BootUp>(), nullptr);
}

TEST(Events, APieceOfAFrameHasUpToSixteenBytes) {
  event::CanFrame frame{.length = 20};
  EXPECT_EQ(frame.bytes(), 16U);
  frame.piece = 1;
  EXPECT_EQ(frame.bytes(), 4U);
  frame.piece = 2;
  EXPECT_EQ(frame.bytes(), 0U);
  const event::CanFrame remote{.length = 8, .remote = true};
  EXPECT_EQ(remote.bytes(), 0U);
}

TEST(EventMembers, AreVisitedInTheOrderOfTheStruct) {
  EXPECT_EQ(members(event::BootUp{}), "");
  EXPECT_EQ(members(event::PdoLength{.number = 3, .mapped = 8, .received = 7}),
            "number=3 mapped=8 received=7 ");
  EXPECT_EQ(members(event::HeartbeatLost{.by = event::ErrorControl::node_guarding,
                                         .time = std::chrono::milliseconds(300)}),
            "by=1 time=300 ");
  EXPECT_EQ(members(event::Emcy{.code = 0x8130, .error_register = 17}),
            "code=33072 error_register=17 manufacturer[5] ");
  EXPECT_EQ(members(event::LssResult{.address = {{1, 2, 3, 4}}}),
            "verdict=0 error=0 specific=0 vendor=1 product=2 revision=3 serial=4 ");
}

}  // namespace
}  // namespace linegate
