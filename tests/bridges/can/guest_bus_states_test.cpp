// SPDX-License-Identifier: Apache-2.0
// Bus states as reported by a real driver. Needs the slcan module, and the right to set interfaces
// up and down. Runs in the guest tier only.
#include <array>
#include <cstdlib>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/tty.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "tests/bridges/can/guest_driven.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;
using can::make_frame;
using Kind = BusEvent::Kind;

// A controller whose reports the test determines: the kernel's slcan driver on a pseudo-terminal.
class SerialController {
 public:
  // configured: the interface has a bit rate and is up.
  explicit SerialController(const std::string& name, bool configured = true) {
    master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    EXPECT_EQ(::grantpt(master_), 0);
    EXPECT_EQ(::unlockpt(master_), 0);
    slave_ = ::open(::ptsname(master_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    for (const int end : {master_, slave_}) {
      termios raw{};
      ::tcgetattr(end, &raw);
      ::cfmakeraw(&raw);
      ::tcsetattr(end, TCSANOW, &raw);
    }
    const int discipline = N_SLCAN;
    EXPECT_EQ(::ioctl(slave_, TIOCSETD, &discipline), 0);
    ifreq request{};
    EXPECT_EQ(::ioctl(slave_, SIOCGIFNAME, &request), 0);
    // Setting the interface up blocks until its commands have been read.
    reader_ = std::jthread([this](const std::stop_token& stop) { read_until(stop); });
    shell("ip link set " + std::string(request.ifr_name) + " name " + name);
    if (configured) {
      shell("ip link set " + name + " type can bitrate 500000");
      shell("ip link set " + name + " up");
    }
  }

  ~SerialController() {
    reader_.request_stop();
    reader_.join();
    ::close(slave_);
    ::close(master_);
  }

  SerialController(const SerialController&) = delete;
  SerialController& operator=(const SerialController&) = delete;

  void report(const std::string& line) {
    EXPECT_EQ(::write(master_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }

 private:
  void read_until(const std::stop_token& stop) const {
    std::array<char, 256> buffer;
    while (!stop.stop_requested()) {
      pollfd entry{master_, POLLIN, 0};
      if (::poll(&entry, 1, 50) == 1 && ::read(master_, buffer.data(), buffer.size()) < 0) {
        break;
      }
    }
  }

  int master_ = -1;
  int slave_ = -1;
  std::jthread reader_;
};

TEST(GuestBusStates, StatesOfARealDriverUpToBusOffAndBack) {
  SerialController controller("slcan7");
  Driven a("slcan7");
  ASSERT_TRUE(a.told(Kind::interface_ready));
  const auto state_is = [&](BusState state) {
    return a.until([&] {
      for (const BusEvent& event : a.events) {
        if (event.kind == Kind::state && event.state == state) {
          return true;
        }
      }
      return false;
    });
  };
  EXPECT_TRUE(state_is(BusState::error_active));
  controller.report("e1a\r");
  EXPECT_TRUE(a.until([&] { return a.told(Kind::error); }));
  EXPECT_EQ(a.events.back().errors & can::kNoAcknowledge, can::kNoAcknowledge);
  controller.report("sw096100\r");
  EXPECT_TRUE(state_is(BusState::error_warning));
  controller.report("sp128130\r");
  EXPECT_TRUE(state_is(BusState::error_passive));
  EXPECT_EQ(a.events.back().receive_errors, 128);
  EXPECT_EQ(a.events.back().transmit_errors, 130);
  controller.report("sb255255\r");
  EXPECT_TRUE(state_is(BusState::bus_off));
  EXPECT_EQ(a.channel().room(now()), 0U);
  EXPECT_EQ(a.channel().write(std::array{make_frame(0x181)}, now()), 0U);

  // A channel that is opened now learns the state without an error frame.
  Driven late("slcan7");
  ASSERT_EQ(late.events.size(), 2U);
  EXPECT_EQ(late.events[1].state, BusState::bus_off);

  a.events.clear();
  shell("ip link set slcan7 down");
  EXPECT_TRUE(state_is(BusState::stopped));
  shell("ip link set slcan7 up");
  EXPECT_TRUE(state_is(BusState::error_active));
  a.send_all(std::array{make_frame(0x181)});
  EXPECT_TRUE(a.until([&] { return a.channel().counters().confirmed == 1; }));
}

TEST(GuestBusStates, AnInterfaceThatIsDownIsSetUpAsItsOptionsSay) {
  SerialController controller("slcan6", false);
  SocketOptions options;
  options.setup = controller_setup(parse_uri("socketcan:slcan6?bitrate=250000").uri).setup;
  Driven a("slcan6", options);
  EXPECT_TRUE(a.until([&] { return a.told(Kind::interface_ready); }));
  shell("ip -details link show slcan6 | grep -q 'bitrate 250000'");
  EXPECT_EQ(a.channel().settings().bit_rate, 250'000U) << "read back from the driver";
  EXPECT_EQ(a.channel().settings().listen_only, false);
  a.send_all(std::array{make_frame(0x181)});
  EXPECT_TRUE(a.until([&] { return a.channel().counters().confirmed == 1; }));
}

TEST(GuestBusStates, WhatADriverCannotDoIsToldOnce) {
  SerialController controller("slcan5", false);
  SocketOptions options;
  options.setup.bit_rate = 123'456;  // serial controllers have a few fixed ones
  Driven a("slcan5", options);
  EXPECT_TRUE(a.until([&] { return a.told(Kind::interface_failed, EINVAL); }));
  EXPECT_FALSE(a.told(Kind::interface_ready));
}

}  // namespace
}  // namespace linegate::can_bridge
