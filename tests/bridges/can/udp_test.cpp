// SPDX-License-Identifier: Apache-2.0
// Frames in datagrams: the codec, and channels on the loopback interface. tests/interop exchanges
// datagrams with python-can.
#include "bridges/can/udp.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/can/error_frame.h"
#include "bridges/can/multicast_codec.h"

namespace linegate::can_bridge {
namespace {

using namespace std::chrono_literals;
using can::BusEvent;
using can::Frame;
using testing::HasSubstr;
using Result = MulticastDecoder::Result;

std::string encoded(const Frame& frame, std::int64_t stamp_ns = 0) {
  std::array<char, kMulticastDatagram> out{};
  return {out.data(), encode_multicast(frame, stamp_ns, out)};
}

class MulticastCodecTest : public testing::Test {
 protected:
  Result decode(std::string_view datagram) {
    return decoder.decode(std::span(datagram.data(), datagram.size()), frame, error);
  }

  MulticastDecoder decoder;
  Frame frame;
  canfd_frame error{};
};

using namespace std::string_view_literals;

// The datagram of python-can 4.1 for Message(arbitration_id=0x181, data=[1, 2],
// is_extended_id=False, timestamp=1.5).
constexpr std::string_view kPythonCan =
    "\x8B\xA9timestamp\xCB\x3F\xF8\0\0\0\0\0\0"
    "\xAE"
    "arbitration_id\xCD\x01\x81"
    "\xAEis_extended_id\xC2"
    "\xAFis_remote_frame\xC2"
    "\xAEis_error_frame\xC2"
    "\xA7"
    "channel\xC0\xA3"
    "dlc\x02\xA4"
    "data\xC4\x02\x01\x02"
    "\xA5is_fd\xC2"
    "\xAE"
    "bitrate_switch\xC2"
    "\xB5"
    "error_state_indicator\xC2"sv;

TEST_F(MulticastCodecTest, AFrameOfPythonCan) {
  ASSERT_EQ(decode(kPythonCan), Result::frame);
  EXPECT_TRUE(can::same_content(frame, can::make_frame(0x181, {1, 2})));
  std::string same(kPythonCan);
  // The same number encoded as a longer integer.
  same.replace(same.find("\xCD\x01\x81"sv), 3, "\xCE\0\0\x01\x81"sv);
  EXPECT_EQ(decode(same), Result::frame);
  EXPECT_EQ(frame.id, 0x181U);
}

TEST_F(MulticastCodecTest, EveryFrameComesBack) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    Frame sent;
    const bool fd = random() % 2 == 0;
    const bool remote = !fd && random() % 3 == 0;
    sent.flags = static_cast<std::uint8_t>(random() % 2);
    sent.id = static_cast<std::uint32_t>(random()) & (sent.extended() ? 0x1FFF'FFFFU : 0x7FFU);
    sent.length = fd ? can::fd_length(random() % 65) : static_cast<std::uint8_t>(random() % 9);
    if (fd) {
      sent.flags = static_cast<std::uint8_t>(sent.flags | Frame::kFd | (random() & 0x18U));
    } else if (remote) {
      sent.flags |= Frame::kRemote;
    }
    for (std::size_t k = 0; !remote && k < sent.length; ++k) {
      sent.data[k] = static_cast<std::byte>(random());
    }
    const std::string datagram = encoded(sent, static_cast<std::int64_t>(random()));
    ASSERT_EQ(decode(datagram), Result::frame);
    ASSERT_TRUE(can::same_content(frame, sent));
  }
}

TEST_F(MulticastCodecTest, MalformedDatagramsAreHarmless) {
  EXPECT_EQ(decode(""), Result::malformed);
  EXPECT_EQ(decode("hello"), Result::malformed);
  EXPECT_EQ(decode("\x80"sv), Result::malformed) << "an empty map";
  EXPECT_EQ(decode("\xDF\xFF\xFF\xFF\xFF"sv), Result::malformed) << "a map with 2^32 - 1 entries";
  EXPECT_EQ(decode("\xDD\xFF\xFF\xFF\xFF"sv), Result::malformed);
  EXPECT_EQ(decode("\x81\xA4"
                   "data\xC6\xFF\xFF\xFF\xFF"
                   "abc"sv),
            Result::malformed);
  EXPECT_EQ(decode(std::string(500, '\x91')), Result::malformed) << "lists in lists";
  EXPECT_EQ(decode(std::string(500, '\x81')), Result::malformed) << "maps in keys of maps";
  const std::string good(kPythonCan);
  for (std::size_t length = 0; length < good.size(); ++length) {
    ASSERT_EQ(decode(good.substr(0, length)), Result::malformed) << length;
  }
  EXPECT_EQ(decode(good + '\0'), Result::malformed);
  const auto changed = [&](std::string_view from, std::string_view to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return decode(text);
  };
  EXPECT_EQ(changed("\xCD\x01\x81"sv, "\xCD\x08\x00"sv), Result::malformed)
      << "not an 11-bit identifier";
  EXPECT_EQ(changed("\xCD\x01\x81"sv, "\xFF"sv), Result::malformed) << "a negative identifier";
  EXPECT_EQ(changed("\xA3"
                    "dlc\x02"sv,
                    "\xA3"
                    "dlc\x03"sv),
            Result::malformed)
      << "a length that differs from that of the data";
  EXPECT_EQ(changed("is_remote_frame\xC2"sv, "is_remote_frame\xC3"sv), Result::malformed)
      << "a remote frame with data";
  EXPECT_EQ(changed("\xA4"
                    "data\xC4\x02\x01\x02"sv,
                    "\xA4"
                    "data\xA2\x01\x02"sv),
            Result::malformed)
      << "data as text";
  EXPECT_EQ(changed("arbitration_id", "arbitration_xx"), Result::malformed);
  EXPECT_EQ(decode(good), Result::frame) << "decoding does not depend on previous datagrams";
}

TEST_F(MulticastCodecTest, RandomBytesAreHarmless) {
  std::mt19937 random(9);
  std::size_t good = 0;
  for (int i = 0; i < 50'000; ++i) {
    std::string datagram(kPythonCan);
    for (auto changes = random() % 6; changes > 0; --changes) {
      datagram[random() % datagram.size()] = static_cast<char>(random());
    }
    good += decode(datagram) == Result::frame ? 1U : 0U;
  }
  EXPECT_GT(good, 5'000U);
  EXPECT_LT(good, 45'000U);
}

TEST_F(MulticastCodecTest, ErrorFrames) {
  std::string text(kPythonCan);
  text.replace(text.find("is_error_frame\xC2"sv), 15, "is_error_frame\xC3"sv);
  text.replace(text.find("\xCD\x01\x81"sv), 3, "\xCD\x00\x20"sv);  // CAN_ERR_ACK
  ASSERT_EQ(decode(text), Result::error_frame);
  ErrorDecoder states;
  BusEvents events;
  states.decode(error, Instant{}, events);
  ASSERT_EQ(events.view().size(), 1U);
  EXPECT_EQ(events.view()[0].errors, can::kNoAcknowledge);
}

TEST(UdpUri, IsChecked) {
  const auto options = [](std::string_view text) {
    const ParsedUri parsed = parse_uri(text);
    EXPECT_TRUE(parsed.ok()) << parsed.error;
    return udp_options(parsed.uri).options;
  };
  EXPECT_EQ(options("udp:239.74.163.2:43113").group, "239.74.163.2");
  EXPECT_EQ(options("udp:239.74.163.2:43113").port, 43113);
  EXPECT_EQ(options("udp:239.74.163.2:43113").ttl, 0) << "stays on this host by default";
  EXPECT_EQ(options("udp:[ff15::1]:9?ttl=2&interface=eth1").group, "ff15::1");
  EXPECT_EQ(options("udp:[ff15::1]:9?ttl=2&interface=eth1").ttl, 2);
  EXPECT_EQ(options("udp:[ff15::1]:9?ttl=2&interface=eth1").interface, "eth1");
  for (const char* text : {"udp:", "udp:239.74.163.2", "udp:10.0.0.1:43113", "udp:239.74.163.2:0",
                           "udp:239.74.163.2:65536", "udp:ff15::1:9", "udp:[239.74.163.2]:9",
                           "udp:[fe80::1]:9", "udp:localhost:9"}) {
    EXPECT_THAT(parse_uri(text).error, HasSubstr("multicast address and a port")) << text;
  }
  EXPECT_THAT(parse_uri("udp:239.74.163.2:9?ttl=256").error, HasSubstr("ttl (0 to 255)"));
  EXPECT_THAT(parse_uri("udp:239.74.163.2:9?hops=1").error, HasSubstr("not \"hops=1\""));
}

// --- on the loopback interface ------------------------------------------------------------------

Instant monotonic() {
  return Instant(std::chrono::steady_clock::now().time_since_epoch());
}

class UdpChannelTest : public testing::Test {
 protected:
  UdpChannelTest() {
    options.group = "239.74.163.77";
    // A port for this process alone, because tests run in parallel.
    options.port = static_cast<std::uint16_t>(20'000 + ::getpid() % 20'000);
  }

  std::unique_ptr<Channel> open() {
    auto channel = open_udp(options);
    std::array<Frame, 1> none;
    events.clear();
    EXPECT_EQ(channel->read(none, events, monotonic()), 0U);
    EXPECT_FALSE(events.empty());
    EXPECT_EQ(events.view()[0].kind, BusEvent::Kind::interface_ready)
        << describe_failure("udp", events.view()[0].code);
    return channel;
  }
  // Reads until the channel has returned `count` frames.
  std::vector<Frame> wait_for(Channel& channel, std::size_t count) {
    std::vector<Frame> out;
    const Instant deadline = monotonic() + 10s;
    while (out.size() < count && monotonic() < deadline) {
      pollfd waiting{channel.descriptor(), POLLIN, 0};
      ::poll(&waiting, 1, 100);
      std::array<Frame, 16> frames;
      events.clear();
      const std::size_t got = channel.read(frames, events, monotonic());
      out.insert(out.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(got));
    }
    return out;
  }
  void send_raw(std::string_view datagram) const {
    const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const in_addr loopback{htonl(INADDR_LOOPBACK)};
    const unsigned char ttl = 0;
    ::setsockopt(descriptor, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback);
    ::setsockopt(descriptor, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(options.port);
    ::inet_pton(AF_INET, options.group.c_str(), &to.sin_addr);
    EXPECT_EQ(::sendto(descriptor, datagram.data(), datagram.size(), 0,
                       reinterpret_cast<const sockaddr*>(&to), sizeof to),
              static_cast<ssize_t>(datagram.size()));
    ::close(descriptor);
  }

  UdpOptions options;
  BusEvents events;
};

TEST_F(UdpChannelTest, FramesReachAllOthersAndAreConfirmed) {
  const auto a = open();
  const auto b = open();
  const auto c = open();
  std::vector<Frame> sent;
  for (std::uint8_t i = 0; i < 40; ++i) {
    sent.push_back(can::make_frame(0x180U + i, {i, 2, 3}));
  }
  ASSERT_GE(a->room(monotonic()), sent.size());
  ASSERT_EQ(a->write(sent, monotonic()), sent.size());
  for (Channel* other : {b.get(), c.get()}) {
    const auto got = wait_for(*other, sent.size());
    ASSERT_EQ(got.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      EXPECT_TRUE(can::same_content(got[i], sent[i]));
      EXPECT_TRUE(i == 0 || got[i].time >= got[i - 1].time);
      EXPECT_LE(got[i].time, monotonic());
    }
  }
  const std::array<Frame, 1> answer{can::make_frame(0x600, {9})};
  EXPECT_EQ(b->write(answer, monotonic()), 1U);
  EXPECT_EQ(wait_for(*a, 1).size(), 1U) << "own frames are not received";
  EXPECT_EQ(a->counters().confirmed, sent.size());
  EXPECT_EQ(a->counters().received, 1U);
}

TEST_F(UdpChannelTest, MalformedDatagramsAreCounted) {
  const auto channel = open();
  send_raw("hello");
  send_raw(std::string(2000, '\x81'));
  send_raw("");
  send_raw(encoded(can::make_frame(0x181, {1})));
  EXPECT_EQ(wait_for(*channel, 1).size(), 1U);
  EXPECT_EQ(channel->counters().malformed, 3U);
}

// A sender that is faster than the reader must not keep a line from its time-outs.
TEST_F(UdpChannelTest, AReadLooksAtSomeDatagramsAndReturns) {
  constexpr std::size_t kDatagrams = 100;
  constexpr std::size_t kPlaces = 8;
  const auto channel = open();
  for (std::size_t i = 0; i < kDatagrams; ++i) {
    send_raw("hello");
  }
  send_raw(encoded(can::make_frame(0x181, {1})));
  std::array<Frame, kPlaces> frames;
  std::size_t got = 0;
  std::uint64_t malformed = 0;
  std::size_t reads = 0;
  const Instant deadline = monotonic() + 60s;
  while (got == 0 && monotonic() < deadline) {
    events.clear();
    got = channel->read(frames, events, monotonic());
    const std::uint64_t looked_at = channel->counters().malformed - malformed + got;
    EXPECT_LE(looked_at, kPlaces);
    EXPECT_EQ(channel->more(), looked_at == kPlaces);
    malformed = channel->counters().malformed;
    ++reads;
  }
  EXPECT_EQ(got, 1U);
  EXPECT_EQ(malformed, kDatagrams);
  EXPECT_GE(reads, kDatagrams / kPlaces);
}

TEST_F(UdpChannelTest, FramesThatCannotExistAreRefused) {
  const auto channel = open();
  Frame wrong = can::make_frame(0x181);
  wrong.id = 0x800;
  EXPECT_EQ(channel->write(std::array<Frame, 1>{wrong}, monotonic()), 1U);
  EXPECT_EQ(channel->counters().refused, 1U);
  EXPECT_EQ(channel->counters().sent, 0U);
}

TEST_F(UdpChannelTest, ANetworkInterfaceThatIsMissingIsToldOnce) {
  options.interface = "nowhere0";
  const auto channel = open_udp(options);
  std::array<Frame, 1> none;
  const Instant start = monotonic();
  EXPECT_EQ(channel->read(none, events, start), 0U);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.view()[0].kind, BusEvent::Kind::interface_failed);
  EXPECT_EQ(events.view()[0].code, static_cast<std::uint32_t>(ENODEV));
  EXPECT_EQ(channel->room(start), 0U);
  EXPECT_GT(channel->next_wake(), start);
  events.clear();
  channel->read(none, events, start + 1s);
  EXPECT_TRUE(events.empty());
}

}  // namespace
}  // namespace linegate::can_bridge
