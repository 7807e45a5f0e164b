// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/hardware_clock.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>
#include <span>

#include <gtest/gtest.h>
#include <linux/errqueue.h>
#include <linux/ethtool.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>
#include <time.h>

#include "bridges/can/frame_socket.h"
#include "bridges/can/receive_clock.h"

namespace linegate::can_bridge {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kBegin = std::chrono::hours(30);  // monotonic clock when the hardware clock is 0

constexpr Instant at(Duration after) {
  return Instant(kBegin + after);
}

TEST(HardwareClock, AFrameThatWaitedHasTheTimeWhenItCame) {
  HardwareClock clock;
  EXPECT_EQ(clock.instant(1'000'000, at(milliseconds(1) + microseconds(20))),
            at(milliseconds(1) + microseconds(20)))
      << "the first delay is the smallest known";
  EXPECT_EQ(clock.instant(2'000'000, at(milliseconds(5))), at(milliseconds(2) + microseconds(20)));
  EXPECT_EQ(clock.instant(3'000'000, at(milliseconds(5))), at(milliseconds(3) + microseconds(20)))
      << "two frames in one packet";
  EXPECT_EQ(clock.instant(6'000'000, at(milliseconds(6))), at(milliseconds(6)))
      << "read without delay";
  EXPECT_EQ(clock.instant(7'000'000, at(milliseconds(9))), at(milliseconds(7)));
}

TEST(HardwareClock, FollowsAClockThatDriftsWithinATenthOfAMillisecond) {
  for (const double ppm : {-50.0, 50.0}) {
    HardwareClock clock;
    std::mt19937 random(1);
    Duration worst{};
    for (int ms = 1; ms < 60'000; ++ms) {
      const Duration real = milliseconds(ms);
      const auto hardware =
          static_cast<std::int64_t>(static_cast<double>(real.count()) * (1 + ppm * 1e-6));
      const Duration waited = microseconds(20 + random() % 1000);  // delay as over USB
      const Instant received = at(real + waited);
      const Instant got = clock.instant(hardware, received);
      EXPECT_LE(got, received);
      if (ms > 1000) {
        worst = std::max(worst, Duration(std::abs((got - at(real)).count())));
      }
    }
    EXPECT_LT(worst, microseconds(120)) << ppm;
  }
}

TEST(HardwareClock, AClockThatWasSetAnewIsFoundAgain) {
  HardwareClock clock;
  clock.instant(100'000'000'000, at(seconds(100)));
  const Instant back = at(seconds(101));
  EXPECT_EQ(clock.instant(5'000, back), back) << "the hardware clock was reset";
  EXPECT_EQ(clock.instant(1'005'000, back + milliseconds(3)), back + milliseconds(1));
  const Instant forward = at(seconds(102));
  EXPECT_EQ(clock.instant(9'000'000'000'000, forward), forward)
      << "the hardware clock jumped ahead";
  EXPECT_EQ(clock.instant(9'000'001'000'000, forward + milliseconds(3)), forward + milliseconds(1));
}

TEST(HardwareClock, AfterASilenceItBeginsAnew) {
  HardwareClock clock;
  clock.instant(0 + 1, at(Duration(1)));
  const Instant later = at(seconds(3600) + milliseconds(100));
  EXPECT_EQ(clock.instant(3'600'000'000'000, later), later)
      << "in an hour clocks drift by a tenth of a second";
}

TEST(HardwareClock, IsOfferedIfAllFramesReceivedAreStampedAndTheStampIsGiven) {
  ethtool_ts_info info{};
  EXPECT_FALSE(offers_hardware_stamps(info)) << "vcan offers no hardware stamps";
  info.so_timestamping = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE |
                         SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
  info.rx_filters = 1U << HWTSTAMP_FILTER_NONE;
  EXPECT_FALSE(offers_hardware_stamps(info));
  info.rx_filters |= 1U << HWTSTAMP_FILTER_ALL;
  EXPECT_TRUE(offers_hardware_stamps(info));
  info.so_timestamping &= ~std::uint32_t{SOF_TIMESTAMPING_RX_HARDWARE};
  EXPECT_FALSE(offers_hardware_stamps(info));
}

TEST(ReceiveClock, TheHardwaresStampCountsWhereThereIsOne) {
  constexpr std::int64_t kWall = 1'800'000'000'000'000'000;
  ReceiveClock clock;
  clock.begin_batch(at(milliseconds(20)), kWall);
  const auto wall = [&](int ms) { return kWall + (ms - 20) * std::int64_t{1'000'000}; };
  EXPECT_EQ(clock.instant(wall(10), 5'000'000), at(milliseconds(10)));
  EXPECT_EQ(clock.instant(wall(15), 7'000'000), at(milliseconds(12)));
  EXPECT_EQ(clock.instant(wall(15), 0), at(milliseconds(15)))
      << "an error frame has no hardware stamp";
  EXPECT_EQ(clock.instant(wall(18), 9'000'000), at(milliseconds(15))) << "time does not go back";
  EXPECT_EQ(clock.instant(0, 14'500'000), at(milliseconds(20))) << "nothing to compare it with";
  clock.begin_batch(at(milliseconds(30)), kWall + 10'000'000);
  EXPECT_EQ(clock.instant(wall(29), 23'000'000), at(milliseconds(28)));
}

// A control message in the layout of the kernel.
template <class T>
std::size_t put(std::span<std::byte> out, int type, const T& content) {
  cmsghdr header{};
  header.cmsg_level = SOL_SOCKET;
  header.cmsg_type = type;
  header.cmsg_len = CMSG_LEN(sizeof content);
  std::memcpy(out.data(), &header, sizeof header);
  std::memcpy(out.data() + CMSG_LEN(0), &content, sizeof content);
  return CMSG_SPACE(sizeof content);
}

TEST(FrameSocket, ReadsStampsAndLossesOfADatagram) {
  alignas(cmsghdr) std::array<std::byte, 256> control{};
  const auto read = [&](std::size_t length) {
    msghdr header{};
    header.msg_control = control.data();
    header.msg_controllen = length;
    FrameSocket::Received out;
    FrameSocket::read_control(header, out);
    return out;
  };
  const timespec software{7, 5};
  std::size_t length = put(control, SCM_TIMESTAMPNS, software);
  length += put(std::span(control).subspan(length), SO_RXQ_OVFL, std::uint32_t{3});
  FrameSocket::Received got = read(length);
  EXPECT_EQ(got.stamp_ns, 7'000'000'005);
  EXPECT_EQ(got.hardware_ns, 0);
  EXPECT_TRUE(got.has_dropped);
  EXPECT_EQ(got.dropped, 3U);

  length = put(control, SCM_TIMESTAMPING, scm_timestamping{{software, {}, {9, 1}}});
  got = read(length);
  EXPECT_EQ(got.stamp_ns, 7'000'000'005);
  EXPECT_EQ(got.hardware_ns, 9'000'000'001);
  EXPECT_FALSE(got.has_dropped);
  EXPECT_EQ(read(0).stamp_ns, 0);
}

}  // namespace
}  // namespace linegate::can_bridge
