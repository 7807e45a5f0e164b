#include "bridges/can/channel.h"

#include <cerrno>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/can/interface_uri.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using testing::HasSubstr;

TEST(InterfaceUri, KnownSchemes) {
  const ParsedUri kernel = parse_uri("socketcan:can0");
  ASSERT_TRUE(kernel.ok()) << kernel.error;
  EXPECT_EQ(kernel.uri.scheme, "socketcan");
  EXPECT_EQ(kernel.uri.name, "can0");
  const ParsedUri embedded = parse_uri("virtual:press line");
  EXPECT_FALSE(embedded.ok());
  EXPECT_TRUE(parse_uri("virtual:press-line").ok());
}

TEST(InterfaceUri, MistakesAreExplained) {
  EXPECT_THAT(parse_uri("can0").error, HasSubstr("write \"socketcan:can0\""));
  EXPECT_THAT(parse_uri("pcan:usb1").error, HasSubstr("unknown interface scheme \"pcan\""));
  EXPECT_THAT(parse_uri("socketcan:").error, HasSubstr("needs a name"));
  EXPECT_THAT(parse_uri("socketcan:../x").error, HasSubstr("needs a name"));
  EXPECT_THAT(parse_uri("socketcan:sixteencharacter").error, HasSubstr("too long: at most 15"));
  EXPECT_TRUE(parse_uri("socketcan:fifteencharacte").ok());
  EXPECT_THAT(parse_uri("virtual:" + std::string(65, 'x')).error, HasSubstr("at most 64"));
}

TEST(DescribeFailure, SaysWhatToDo) {
  EXPECT_EQ(describe_failure("can9", ENODEV), "no such interface: can9");
  EXPECT_THAT(describe_failure("can0", ENETDOWN), HasSubstr("ip link set can0 up"));
  EXPECT_THAT(describe_failure("can0", EAFNOSUPPORT), HasSubstr("no CAN support (AF_CAN)"));
  EXPECT_THAT(describe_failure("can0", EPROTONOSUPPORT), HasSubstr("modprobe can-raw"));
  EXPECT_THAT(describe_failure("can0", EPERM), HasSubstr("permission"));
  EXPECT_THAT(describe_failure("lo", EMEDIUMTYPE), HasSubstr("lo is not a CAN interface"));
  EXPECT_THAT(describe_failure("can0", EIO), HasSubstr("can0: "));
}

TEST(BusEvents, ErrorsInARowBecomeOne) {
  BusEvents events;
  BusEvent error;
  error.kind = BusEvent::Kind::error;
  error.errors = can::kProtocol;
  error.count = 1;
  events.push(error);
  error.errors = can::kNoAcknowledge;
  error.transmit_errors = 8;
  events.push(error);
  ASSERT_EQ(events.view().size(), 1U);
  EXPECT_EQ(events.view()[0].errors, can::kProtocol | can::kNoAcknowledge);
  EXPECT_EQ(events.view()[0].count, 2U);
  EXPECT_EQ(events.view()[0].transmit_errors, 8);
}

TEST(BusEvents, StatesAreAllKept) {
  BusEvents events;
  BusEvent event;
  for (std::size_t i = 0; i < BusEvents::kCapacity; ++i) {
    EXPECT_EQ(events.room(), BusEvents::kCapacity - i);
    events.push(event);
  }
  EXPECT_EQ(events.view().size(), BusEvents::kCapacity);
  events.clear();
  EXPECT_TRUE(events.empty());
}

TEST(BusEvents, KnowHowManyFramesCameBefore) {
  BusEvents events;
  BusEvent state;
  events.push(state);
  events.frames_given(3);
  BusEvent error;
  error.kind = BusEvent::Kind::error;
  events.push(error);
  events.frames_given(2);
  events.push(error);  // becomes one with the error before, which so has the later time and place
  events.push(state);
  ASSERT_EQ(events.view().size(), 3U);
  EXPECT_EQ(events.frames_before(0), 0U);
  EXPECT_EQ(events.frames_before(1), 5U);
  EXPECT_EQ(events.frames_before(2), 5U);
  events.clear();
  events.push(state);
  EXPECT_EQ(events.frames_before(0), 0U);
}

}  // namespace
}  // namespace linegate::can_bridge
