// Real SocketCAN: needs vcan0 (classical) and vcan1 (CAN FD), and the right to set interfaces up
// and down. Runs in the guest tier only.
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/tty.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "bridges/can/socketcan.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;
using can::Frame;
using can::make_frame;
using Kind = BusEvent::Kind;

constexpr Duration kPatience = std::chrono::seconds(10);

Instant now() {
  return Instant(std::chrono::steady_clock::now().time_since_epoch());
}

void shell(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

// A channel with somebody who drives it as an executor does.
class Driven {
 public:
  explicit Driven(const std::string& interface, std::size_t depth = 8) {
    SocketOptions options;
    options.queue_depth = depth;
    options.retry_period = std::chrono::milliseconds(50);
    channel_ = open_socketcan(interface, options);
    turn(Duration{});
  }

  // Waits for something to do, at most so long, and reads.
  void turn(Duration longest) {
    const Duration until_wake = channel_->next_wake() == kNever
                                    ? longest
                                    : std::min(longest, channel_->next_wake() - now());
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(until_wake).count();
    pollfd entry{channel_->descriptor(),
                 static_cast<short>(POLLIN | (channel_->wants_writable() ? POLLOUT : 0)), 0};
    ::poll(&entry, 1, static_cast<int>(std::max<std::int64_t>(ms, 0)));
    std::array<Frame, 64> out;
    BusEvents told;
    const std::size_t count = channel_->read(out, told, now());
    frames.insert(frames.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count));
    events.insert(events.end(), told.view().begin(), told.view().end());
  }

  template <class Predicate>
  bool until(Predicate predicate) {
    const Instant deadline = now() + kPatience;
    while (!predicate()) {
      if (now() > deadline) {
        return false;
      }
      turn(std::chrono::milliseconds(50));
    }
    return true;
  }

  void send_all(std::span<const Frame> all) {
    const Instant deadline = now() + kPatience;
    while (!all.empty() && now() < deadline) {
      const std::size_t room = std::min(channel_->room(now()), all.size());
      all = all.subspan(channel_->write(all.first(room), now()));
      if (!all.empty()) {
        turn(std::chrono::milliseconds(50));
      }
    }
    EXPECT_TRUE(all.empty());
  }

  bool told(Kind kind, std::uint32_t code = 0) const {
    for (const BusEvent& event : events) {
      if (event.kind == kind && event.code == code) {
        return true;
      }
    }
    return false;
  }

  Channel& channel() { return *channel_; }

  std::vector<Frame> frames;
  std::vector<BusEvent> events;

 private:
  std::unique_ptr<Channel> channel_;
};

TEST(GuestSocketcan, FramesCrossInOrderAndOwnOnesAreOnlyConfirmed) {
  Driven a("vcan0");
  Driven b("vcan0");
  ASSERT_TRUE(a.told(Kind::interface_ready));
  std::vector<Frame> sent;
  for (std::uint32_t i = 0; i < 500; ++i) {
    sent.push_back(make_frame(0x180 + i % 127, {static_cast<std::uint8_t>(i), 7}));
  }
  const Instant before = now();
  a.send_all(sent);
  ASSERT_TRUE(b.until([&] { return b.frames.size() == sent.size(); }));
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_TRUE(same_content(sent[i], b.frames[i]));
    EXPECT_GE(b.frames[i].time, before - std::chrono::milliseconds(1));
    EXPECT_LE(b.frames[i].time, now());
  }
  ASSERT_TRUE(a.until([&] { return a.channel().counters().confirmed == sent.size(); }));
  EXPECT_TRUE(a.frames.empty());
  EXPECT_EQ(a.channel().room(now()), 8U);
}

TEST(GuestSocketcan, NoMoreThanTheDepthIsUnconfirmed) {
  Driven a("vcan0", 4);
  EXPECT_EQ(a.channel().room(now()), 4U);
  const std::vector<Frame> ten(10, make_frame(0x181));
  EXPECT_EQ(a.channel().write(ten, now()), 4U);
  EXPECT_EQ(a.channel().room(now()), 0U);
  EXPECT_EQ(a.channel().counters().stalled, 1U);
  ASSERT_TRUE(a.until([&] { return a.channel().room(now()) == 4U; }));
}

TEST(GuestSocketcan, FdFramesOnlyWhereTheInterfaceAllows) {
  Frame fd = make_frame(0x181);
  fd.flags = Frame::kFd | Frame::kBitRateSwitch;
  fd.length = 64;
  fd.data.fill(std::byte{0x5A});
  Driven a("vcan1");
  Driven b("vcan1");
  a.send_all(std::array{fd});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 1; }));
  EXPECT_TRUE(same_content(fd, b.frames[0]));
  Driven classical("vcan0");
  classical.send_all(std::array{fd});
  EXPECT_EQ(classical.channel().counters().refused, 1U);
}

TEST(GuestSocketcan, ExtendedAndRemoteFrames) {
  Frame extended = make_frame(0);
  extended.id = 0x1234'5678;
  extended.flags = Frame::kExtended;
  Frame remote = make_frame(0x705);
  remote.flags = Frame::kRemote;
  remote.length = 1;
  Driven a("vcan0");
  Driven b("vcan0");
  a.send_all(std::array{extended, remote});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 2; }));
  EXPECT_TRUE(same_content(extended, b.frames[0]));
  EXPECT_EQ(b.frames[1].flags, Frame::kRemote);
  ASSERT_TRUE(a.until([&] { return a.channel().counters().confirmed == 2; }));
}

TEST(GuestSocketcan, MissingInterfaceIsNamed) {
  Driven a("can9");
  EXPECT_TRUE(a.told(Kind::interface_failed, ENODEV));
  EXPECT_EQ(describe_failure("can9", ENODEV), "no such interface: can9");
  Driven loopback("lo");
  EXPECT_TRUE(loopback.told(Kind::interface_failed, EMEDIUMTYPE));
}

TEST(GuestSocketcan, DownAndUpAgain) {
  shell("ip link add vcan7 type vcan && ip link set vcan7 up");
  Driven a("vcan7");
  Driven b("vcan7");
  EXPECT_EQ(a.channel().write(std::array{make_frame(0x181)}, now()), 1U);
  shell("ip link set vcan7 down");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENETDOWN); }));
  EXPECT_EQ(a.events.back().state, BusState::stopped);
  EXPECT_EQ(a.channel().room(now()), 0U);
  a.events.clear();
  shell("ip link set vcan7 up");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_ready); }));
  EXPECT_EQ(a.channel().room(now()), 8U);
  b.frames.clear();
  ASSERT_TRUE(
      b.until([&] { return b.channel().descriptor() >= 0 && b.channel().room(now()) > 0; }));
  a.send_all(std::array{make_frame(0x182)});
  ASSERT_TRUE(b.until([&] { return !b.frames.empty(); }));
  shell("ip link del vcan7");
}

TEST(GuestSocketcan, RemovedAndAddedAgain) {
  shell("ip link add vcan8 type vcan && ip link set vcan8 up");
  Driven a("vcan8");
  shell("ip link del vcan8");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENODEV); }));
  EXPECT_EQ(a.events.back().state, BusState::absent);
  a.events.clear();
  shell("ip link add vcan8 type vcan && ip link set vcan8 up");
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_ready); }));
  a.send_all(std::array{make_frame(0x181)});
  ASSERT_TRUE(a.until([&] { return a.channel().counters().confirmed == 1; }));
  shell("ip link del vcan8");
}

// Written while the interface is down: told by the next read(), and nothing is counted as sent.
TEST(GuestSocketcan, WritingToADownInterfaceIsNotSending) {
  shell("ip link add vcan6 type vcan && ip link set vcan6 up");
  Driven a("vcan6");
  shell("ip link set vcan6 down");
  EXPECT_EQ(a.channel().write(std::array{make_frame(0x181)}, now()), 0U);
  ASSERT_TRUE(a.until([&] { return a.told(Kind::interface_failed, ENETDOWN); }));
  EXPECT_EQ(a.channel().counters().sent, 0U);
  shell("ip link del vcan6");
}

TEST(GuestSocketcan, WallClockStepDoesNotShow) {
  Driven a("vcan0");
  Driven b("vcan0");
  a.send_all(std::array{make_frame(0x181)});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 1; }));
  const Instant before = now();
  a.send_all(std::array{make_frame(0x182)});
  shell("date -s '+1 hour' >/dev/null");
  a.send_all(std::array{make_frame(0x183)});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 3; }));
  shell("date -s '-1 hour' >/dev/null");
  a.send_all(std::array{make_frame(0x184)});
  ASSERT_TRUE(b.until([&] { return b.frames.size() == 4; }));
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_GE(b.frames[i].time, before - std::chrono::milliseconds(5));
    EXPECT_LE(b.frames[i].time, now());
  }
}

TEST(GuestSocketcan, OverflowOfTheReceiveQueueIsCounted) {
  SocketOptions options;
  options.receive_buffer = 4096;
  const auto slow = open_socketcan("vcan0", options);
  std::array<Frame, 64> out;
  BusEvents events;
  slow->read(out, events, now());
  Driven a("vcan0");
  const std::vector<Frame> many(200, make_frame(0x181));
  a.send_all(many);
  std::uint64_t got = 0;
  events.clear();
  got += slow->read(out, events, now());
  a.send_all(std::array{make_frame(0x182)});
  got += slow->read(out, events, now());
  EXPECT_GT(slow->counters().lost, 0U);
  EXPECT_EQ(got + slow->counters().lost, 201U);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.view().back().kind, Kind::frames_lost);
}

// A controller that can be told what to report: the kernel's slcan driver on a pseudo-terminal.
class SerialController {
 public:
  explicit SerialController(const std::string& name) {
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
    // Setting the interface up waits until its commands have been read.
    reader_ = std::jthread([this](const std::stop_token& stop) { read_until(stop); });
    shell("ip link set " + std::string(request.ifr_name) + " name " + name);
    shell("ip link set " + name + " type can bitrate 500000");
    shell("ip link set " + name + " up");
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

TEST(GuestSocketcan, StatesOfARealDriverUpToBusOffAndBack) {
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

  // Whoever opens it now learns the state although no error frame tells it.
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

}  // namespace
}  // namespace linegate::can_bridge
