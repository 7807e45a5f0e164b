// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/channel.h"

#include <cerrno>
#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can/netlink.h>

#include "bridges/can/interface_uri.h"
#include "bridges/can/socketcan.h"
#include "bridges/can/virtual_faults.h"

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

TEST(InterfaceUri, SetsAControllerUp) {
  const auto setup = [](const char* text) {
    const ParsedUri parsed = parse_uri(text);
    EXPECT_TRUE(parsed.ok()) << parsed.error;
    return controller_setup(parsed.uri).setup;
  };
  EXPECT_FALSE(setup("socketcan:can0").any());
  const ControllerSetup all = setup(
      "socketcan:can0?bitrate=500000&sample-point=0.875&dbitrate=2000000&dsample-point=0.75&"
      "restart-ms=0&listen-only=on");
  EXPECT_TRUE(all.any());
  EXPECT_EQ(all.bit_rate, 500'000U);
  EXPECT_EQ(all.sample_point, 875U);
  EXPECT_EQ(all.data_bit_rate, 2'000'000U);
  EXPECT_EQ(all.data_sample_point, 750U);
  EXPECT_EQ(all.restart_ms, 0U);
  EXPECT_EQ(all.listen_only, true);
  EXPECT_EQ(setup("socketcan:can0?listen-only=off").listen_only, false);
  EXPECT_FALSE(setup("socketcan:can0?listen-only=off").any());
  EXPECT_TRUE(setup("socketcan:can0?restart-ms=100").any());
  for (const char* text : {"bitrate=500k", "bitrate=0", "bitrate=20000001", "sample-point=87",
                           "restart-ms=-1", "listen-only=yes", "restart=100"}) {
    EXPECT_THAT(parse_uri(std::string("socketcan:can0?") + text).error,
                HasSubstr(std::string("not \"") + text + "\""));
  }
  EXPECT_THAT(parse_uri("socketcan:can0?sample-point=0.8").error, HasSubstr("needs its bit rate"));
  EXPECT_THAT(parse_uri("socketcan:can0?dbitrate=2000000").error, HasSubstr("needs bitrate"));
}

// A controller keeps its modes while it is down: one in listen-only mode stays in it until the mode
// is cleared.
TEST(InterfaceUri, TellsAControllerWhichModesToTakeAndWhichToLeave) {
  struct Row {
    ControllerSetup setup;
    std::uint32_t mask;
    std::uint32_t flags;
  } const rows[] = {
      {{.bit_rate = 500'000}, 0, 0},
      {{.bit_rate = 500'000, .listen_only = true},
       CAN_CTRLMODE_LISTENONLY,
       CAN_CTRLMODE_LISTENONLY},
      {{.bit_rate = 500'000, .listen_only = false}, CAN_CTRLMODE_LISTENONLY, 0},
      {{.bit_rate = 500'000, .data_bit_rate = 2'000'000, .listen_only = false},
       CAN_CTRLMODE_LISTENONLY | CAN_CTRLMODE_FD,
       CAN_CTRLMODE_FD},
  };
  for (const Row& row : rows) {
    const ControllerModes modes = modes_of(row.setup);
    EXPECT_EQ(modes.mask, row.mask);
    EXPECT_EQ(modes.flags, row.flags);
  }
}

TEST(InterfaceUri, FaultsOfAVirtualBus) {
  const auto faults = [](const char* text) {
    const ParsedUri parsed = parse_uri(text);
    EXPECT_TRUE(parsed.ok()) << parsed.error;
    return virtual_faults(parsed.uri).faults;
  };
  EXPECT_FALSE(faults("virtual:a").of_bus());
  const VirtualFaults all =
      faults("virtual:a?lost=1%&disturbed=0.005&doubled=0.1%&bus_off=10s&seed=7");
  EXPECT_TRUE(all.of_bus());
  EXPECT_DOUBLE_EQ(all.lost, 0.01);
  EXPECT_DOUBLE_EQ(all.disturbed, 0.005);
  EXPECT_DOUBLE_EQ(all.doubled, 0.001);
  EXPECT_EQ(all.bus_off, std::chrono::seconds(10));
  EXPECT_EQ(all.seed, 7U);
  const VirtualFaults stuck = faults("virtual:a?stuck=5@10s");
  EXPECT_TRUE(stuck.of_bus());
  EXPECT_EQ(stuck.stuck, 5);
  EXPECT_EQ(stuck.stuck_time, std::chrono::seconds(10));
  EXPECT_EQ(faults("virtual:a?bus_off=1500ms").bus_off, std::chrono::milliseconds(1500));
  EXPECT_EQ(faults("virtual:a?bus_off=2s").restart, std::chrono::seconds(1));
  EXPECT_EQ(faults("virtual:a?bus_off=2s&restart=0.5s").restart, std::chrono::milliseconds(500));
  EXPECT_EQ(faults("virtual:a?restart=never&bus_off=2s").restart, Duration{});
  for (const char* text : {"lost=2", "lost=-1%", "lost=", "lost=nan", "disturbed=100%", "seed=x",
                           "bus_off=10", "bus_off=1s", "restart=0s", "bus_off=2d", "loss=1%",
                           "stuck=5", "stuck=0@10s", "stuck=128@10s", "stuck=5@1s", "stuck=@10s"}) {
    EXPECT_THAT(parse_uri(std::string("virtual:a?") + text).error,
                HasSubstr(std::string("not \"") + text + "\""));
  }
  EXPECT_THAT(parse_uri("virtual:a?lost=60%&doubled=60%").error, HasSubstr("more than 100%"));
  EXPECT_EQ(parse_uri("virtual:a?bus_off=2s&restart=2s").error,
            "restart is not shorter than bus_off");
}

TEST(InterfaceUri, ANodeOfAVirtualBusMayBeStuckFromTheStart) {
  const ParsedUri parsed = parse_uri("virtual:a?stuck=5@always");
  ASSERT_TRUE(parsed.ok()) << parsed.error;
  EXPECT_EQ(virtual_faults(parsed.uri).faults.stuck, 5);
  EXPECT_EQ(virtual_faults(parsed.uri).faults.stuck_time, Duration{});
}

TEST(VirtualFaults, ChangeWhileTheBusRuns) {
  VirtualFaults faults;
  const auto after = [&](const char* text) {
    const FaultChange change = change_faults(faults, text);
    EXPECT_EQ(change.error, "") << text;
    faults = change.faults;
    return to_string(faults);
  };
  EXPECT_EQ(after(""), "off");
  EXPECT_EQ(after("stuck=5@10s&lost=1%"), "lost=1%&stuck=5@10s");
  EXPECT_EQ(after("disturbed=0.5%&doubled=12.5%"),
            "lost=1%&disturbed=0.5%&doubled=12.5%&stuck=5@10s");
  EXPECT_EQ(after("lost=off&doubled=off&stuck=6@always"), "disturbed=0.5%&stuck=6@always");
  EXPECT_EQ(after("disturbed=off&stuck=off&bus_off=2500ms&restart=never&seed=7"),
            "bus_off=2.5s&restart=never&seed=7");
  EXPECT_EQ(after("bus_off=now"), "bus_off=2.5s&restart=never&seed=7");
  EXPECT_EQ(parse_uri("virtual:a?" + to_string(faults)).error, "")
      << "in the notation of the interface";
  EXPECT_TRUE(change_faults(faults, "bus_off=now").bus_off_now);
  EXPECT_TRUE(change_faults(faults, "bus_off=off").bus_off_ends);
  EXPECT_TRUE(change_faults(faults, "off").bus_off_ends);
  EXPECT_EQ(after("off"), "off");
}

TEST(VirtualFaults, AChangeThatIsWrongIsToldAndChangesNothing) {
  const auto error = [](const char* text) { return change_faults({}, text).error; };
  EXPECT_THAT(error("lost=200%"), HasSubstr("not \"lost=200%\""));
  EXPECT_THAT(error("lost=1%&stuck=5"), HasSubstr("not \"stuck=5\""));
  EXPECT_THAT(error("seed=off"), HasSubstr("not \"seed=off\""));
  EXPECT_THAT(error("speed=off"), HasSubstr("not \"speed=off\""));
  EXPECT_THAT(error("lost=now"), HasSubstr("not \"lost=now\""));
  EXPECT_THAT(error("lost"), HasSubstr("not written key=value"));
  EXPECT_THAT(error("lost=1%&lost=off"), HasSubstr("there twice"));
  EXPECT_THAT(error("lost=60%&doubled=60%"), HasSubstr("more than 100%"));
  VirtualFaults faults;
  faults.bus_off = std::chrono::seconds(2);
  EXPECT_EQ(change_faults(faults, "restart=3s").error, "restart is not shorter than bus_off");
}

TEST(DescribeFailure, SaysWhatToDo) {
  EXPECT_EQ(describe_failure("can9", ENODEV), "no such interface: can9");
  EXPECT_THAT(describe_failure("can0", ENETDOWN), HasSubstr("ip link set can0 up"));
  EXPECT_THAT(describe_failure("can0", EMSGSIZE), HasSubstr("ip link set can0 mtu 72"));
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
  events.push(error);  // merged into the preceding error, which gets the later time and position
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
