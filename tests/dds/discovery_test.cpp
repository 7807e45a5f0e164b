// SPDX-License-Identifier: Apache-2.0
// Forged announcements of participants occupy a bounded number of places, and never the place of a
// participant that is present.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/dds/guard/discovered.h"
#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"
#include "tests/dds/sanitizers.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

// DDSI-RTPS 2.3, 9.6.1.1: PB + DG x domain + d1 + PG x participant.
std::uint16_t metatraffic_port(std::uint32_t domain, std::uint32_t participant) {
  return static_cast<std::uint16_t>(7'400 + 250 * domain + 10 + 2 * participant);
}

void append(std::string& out, std::uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) {
    out.push_back(static_cast<char>(value >> 8 * i & 0xFF));
  }
}

void append_parameter(std::string& out, std::uint16_t id, const std::string& value) {
  append(out, id, 2);
  append(out, value.size(), 2);
  out += value;
}

// 127.0.0.1 and a port without a receiver, as Locator_t.
std::string nowhere() {
  std::string out;
  append(out, 1, 4);
  append(out, 9, 4);
  out += std::string(12, '\0') + "\x7F" + std::string(2, '\0') + "\x01";
  return out;
}

// A datagram with one DATA of a builtin writer. The entity IDs are given as octets, big-endian.
std::string datagram(const std::string& prefix, const std::string& reader,
                     const std::string& writer, std::uint32_t number, std::string parameters) {
  using namespace std::string_literals;
  append_parameter(parameters, 0x0001, "");
  std::string data = "\0\0\x10\0"s + reader + writer;
  append(data, 0, 4);
  append(data, number, 4);
  data += "\0\x03\0\0"s + parameters;  // encapsulation: PL_CDR_LE
  std::string out = "RTPS\x02\x03\x01\x0F"s + prefix + "\x15\x05"s;
  append(out, data.size(), 2);
  return out + data;
}

std::string invented(std::uint32_t number) {
  using namespace std::string_literals;
  std::string prefix = "\x01\x0F"s + "invent"s;
  append(prefix, number, 4);
  return prefix;
}

// The announcement (SPDP) of a participant that does not exist. It expires after its lease.
std::string announcement(std::uint32_t number, std::uint32_t lease_seconds) {
  using namespace std::string_literals;
  std::string parameters;
  append_parameter(parameters, 0x0015, "\x02\x03\0\0"s);
  append_parameter(parameters, 0x0016, "\x01\x0F\0\0"s);
  append_parameter(parameters, 0x0050, invented(number) + "\0\0\x01\xC1"s);
  append_parameter(parameters, 0x0032, nowhere());
  append_parameter(parameters, 0x0031, nowhere());
  std::string lease;
  append(lease, lease_seconds, 4);
  append(lease, 0, 4);
  append_parameter(parameters, 0x0002, lease);
  append_parameter(parameters, 0x0058, "\x3F\x0C\0\0"s);
  return datagram(invented(number), "\0\x01\0\xC7"s, "\0\x01\0\xC2"s, 1, parameters);
}

// The announcement (SEDP) of writer `number` of a forged participant. Numbers begin with 1.
std::string writer_announcement(std::uint32_t participant, std::uint32_t number,
                                const std::string& topic = "invented",
                                const std::string& type = "Invented") {
  using namespace std::string_literals;
  const std::string guid = invented(participant) + static_cast<char>(number >> 16U) +
                           static_cast<char>(number >> 8U) + static_cast<char>(number) + "\x02"s;
  const auto text = [](std::string value) {
    std::string out;
    append(out, value.size() + 1, 4);
    value.resize(value.size() / 4 * 4 + 4);
    return out + value;
  };
  std::string parameters;
  append_parameter(parameters, 0x005A, guid);
  append_parameter(parameters, 0x0005, text(topic));
  append_parameter(parameters, 0x0007, text(type));
  append_parameter(parameters, 0x002F, nowhere());
  return datagram(invented(participant), "\0\0\x03\xC7"s, "\0\0\x03\xC2"s, number, parameters);
}

// The announcement that this writer ended, as sample `number` of the builtin writer.
std::string writer_end(std::uint32_t participant, std::uint32_t writer, std::uint32_t number) {
  using namespace std::string_literals;
  std::string parameters;
  append_parameter(parameters, 0x0070,
                   invented(participant) + static_cast<char>(writer >> 16U) +
                       static_cast<char>(writer >> 8U) + static_cast<char>(writer) + "\x02"s);
  append_parameter(parameters, 0x0071, "\0\0\0\x03"s);
  append_parameter(parameters, 0x0001, "");
  std::string data = "\0\0\x10\0\0\0\x03\xC7\0\0\x03\xC2"s;
  append(data, 0, 4);
  append(data, number, 4);
  data += parameters;
  std::string out = "RTPS\x02\x03\x01\x0F"s + invented(participant) + "\x15\x03"s;
  append(out, data.size(), 2);
  return out + data;
}

class SpdpSender {
 public:
  // from: source address, an address of this host in 127.0.0.0/8.
  explicit SpdpSender(std::uint16_t port, std::uint32_t from = INADDR_LOOPBACK) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(from);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    to_.sin_family = AF_INET;
    to_.sin_port = htons(port);
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }
  ~SpdpSender() { ::close(socket_); }
  SpdpSender(const SpdpSender&) = delete;
  SpdpSender& operator=(const SpdpSender&) = delete;

  void send(const std::string& datagram) const {
    EXPECT_EQ(::sendto(socket_, datagram.data(), datagram.size(), 0,
                       reinterpret_cast<const sockaddr*>(&to_), sizeof to_),
              static_cast<ssize_t>(datagram.size()));
  }

 private:
  int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to_{};
};

// A gateway that publishes events, and a subscriber in a separate process that prints them.
class EventGateway {
 public:
  // places: largest number of participants; 0: the default.
  explicit EventGateway(std::size_t places = 0) : bridge_(make(places)) {}

  bool begins() { return bridge_ && subscriber_.expect("ready") == "ready" && is_received(); }
  dds::GatewayBridge& bridge() { return *bridge_; }
  // Publishes one more event and returns whether the subscriber received it.
  bool is_received() {
    ++number_;
    EXPECT_TRUE(bridge_->publish(known::kLine, known::event(number_), "text"));
    return subscriber_.expect(last()) == last();
  }
  // The line that a subscriber prints for the newest event.
  std::string last() const { return "event " + std::to_string(number_); }

 private:
  static std::unique_ptr<dds::GatewayBridge> make(std::size_t places) {
    dds::GatewayOptions options{
        known::kGateway, 1, domain(), paths::kLoopbackProfiles, {known::kLine}};
    options.participants = places;
    auto made = dds::GatewayBridge::make(options);
    return made.ok() ? *std::move(made.value) : nullptr;
  }

  // Created before the subscriber, so that it is the first participant of the domain.
  std::unique_ptr<dds::GatewayBridge> bridge_;
  Peer subscriber_{"subscriber"};
  std::uint64_t number_ = 0;
};

TEST(Discovery, InventedParticipantsTakeABoundedNumberOfPlaces) {
  constexpr std::size_t kPlaces = 8;
  EventGateway gateway(kPlaces);
  ASSERT_TRUE(gateway.begins());
  dds::GatewayBridge& bridge = gateway.bridge();
  EXPECT_EQ(bridge.discovery().most, kPlaces);
  ASSERT_EQ(bridge.discovery().participants, 1U);

  // The first participant of the domain is the gateway.
  const SpdpSender stranger(metatraffic_port(domain(), 0));
  constexpr std::uint32_t kInvented = 500;
  constexpr std::uint32_t kLease = 3;  // seconds
  ASSERT_TRUE(eventually([&] {
    for (std::uint32_t i = 0; i < kInvented; ++i) {
      stranger.send(announcement(i, kLease));
    }
    return bridge.discovery().participants == kPlaces;
  })) << bridge.discovery().participants;
  for (std::uint32_t i = kInvented; i < 2 * kInvented; ++i) {
    stranger.send(announcement(i, kLease));
  }
  EXPECT_TRUE(gateway.is_received()) << "a subscriber that was matched before has lost its place";
  EXPECT_LE(bridge.discovery().participants, kPlaces);
  EXPECT_LE(bridge.discovery().discovered - bridge.discovery().gone, kPlaces);

  // There is room again when the leases of the forged participants have expired.
  EXPECT_TRUE(eventually([&] { return bridge.discovery().participants == 1; }, kDeadline * 3));
  EXPECT_TRUE(gateway.is_received());
  Peer late("subscriber");
  ASSERT_EQ(late.expect("ready"), "ready");
  EXPECT_EQ(late.expect(gateway.last()), gateway.last());
}

// The loopback profiles with 127.0.0.1 as the address of the initial peers.
std::string profiles_with_peers() {
  std::ifstream in(paths::kLoopbackProfiles);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::string peers =
      "<initialPeersList><locator><udpv4><address>239.255.0.1</address></udpv4></locator>"
      "<locator><udpv4><address>127.0.0.1</address></udpv4></locator></initialPeersList>";
  const std::size_t at = text.find("<builtin>", text.find("profile_name=\"linegate\""));
  EXPECT_NE(at, std::string::npos);
  return text.insert(at + 9, peers);
}

TEST(DiscoveryOfPeers, FindPlacesAmongInventedParticipants) {
  constexpr std::size_t kPlaces = 8;
  const File profiles(profiles_with_peers());
  dds::GatewayOptions options{known::kGateway, 1, domain(), profiles.path, {known::kLine}};
  options.participants = kPlaces;
  auto gateway = dds::GatewayBridge::make(options);
  ASSERT_TRUE(gateway.ok());
  dds::GatewayBridge& bridge = **gateway.value;
  const SpdpSender stranger(metatraffic_port(domain(), 0), 0x7F000042);
  constexpr std::uint32_t kLease = 600;
  ASSERT_TRUE(eventually([&] {
    for (std::uint32_t i = 0; i < 100; ++i)
      stranger.send(announcement(i, kLease));
    return bridge.discovery().participants == kPlaces * 3 / 4;
  })) << bridge.discovery().participants;
  for (std::uint32_t i = 100; i < 600; ++i)
    stranger.send(announcement(i, kLease));
  EXPECT_TRUE(bridge.publish(known::kLine, known::event(1), "text"));
  Peer late("subscriber", profiles.path);
  EXPECT_EQ(late.expect("event 1"), "event 1");
  EXPECT_EQ(bridge.discovery().participants, kPlaces * 3 / 4 + 1);
  EXPECT_GT(bridge.guard_counters().of(dds::guard::Reason::participants), 0U);
}

TEST(Discovery, AParticipantTakesABoundedNumberOfPlacesForItsEndpoints) {
  EventGateway gateway;
  ASSERT_TRUE(gateway.begins());
  dds::GatewayBridge& bridge = gateway.bridge();
  // The subscriber's endpoints: all of them are known when none was added for a second.
  std::size_t before = 0;
  ASSERT_TRUE(eventually([&] {
    before = bridge.guard_counters().endpoints;
    std::this_thread::sleep_for(std::chrono::seconds(1));
    return before > 0 && bridge.guard_counters().endpoints == before;
  })) << before;
  const SpdpSender stranger(metatraffic_port(domain(), 0));
  ASSERT_TRUE(eventually([&] {
    stranger.send(announcement(1, 600));
    return bridge.discovery().participants >= 2;
  }));
  // Sent in order: the library waits for missing numbers. Repeated, because a socket may lose some.
  const auto announced = [&] { return bridge.guard_counters().endpoints - before; };
  std::uint32_t next = 1;
  ASSERT_TRUE(eventually([&] {
    next = static_cast<std::uint32_t>(announced()) + 1;
    for (std::uint32_t i = next; i < next + 200; ++i)
      stranger.send(writer_announcement(1, i));
    return announced() >= dds::guard::Discovered::kEndpoints;
  })) << announced();
  for (std::uint32_t i = 0; i < 20'000; ++i)
    stranger.send(writer_announcement(1, next + i));
  EXPECT_TRUE(gateway.is_received());
  EXPECT_EQ(announced(), dds::guard::Discovered::kEndpoints);
  EXPECT_GT(bridge.guard_counters().of(dds::guard::Reason::endpoints), 0U);
  Peer late("subscriber");
  EXPECT_EQ(late.expect(gateway.last()), gateway.last());
}

// The library processes samples of discovery in order of their numbers. Here the ends follow
// announcements that the guard dropped for lack of a place.
TEST(Discovery, APlaceIsGivenBackWhenAnEndpointEnds) {
  constexpr auto kMost = static_cast<std::uint32_t>(dds::guard::Discovered::kEndpoints);
  constexpr std::uint32_t kTooMany = 10;
  constexpr std::uint32_t kEnds = 20;
  dds::GatewayOptions options{
      known::kGateway, 1, domain(), paths::kLoopbackProfiles, {known::kLine}};
  auto gateway = dds::GatewayBridge::make(options);
  ASSERT_TRUE(gateway.ok());
  dds::GatewayBridge& bridge = **gateway.value;
  const SpdpSender stranger(metatraffic_port(domain(), 0));
  ASSERT_TRUE(eventually([&] {
    stranger.send(announcement(1, 600));
    return bridge.discovery().participants >= 1;
  }));
  const std::size_t own = bridge.guard_counters().endpoints;
  const auto announced = [&] { return bridge.guard_counters().endpoints - own; };
  // Sent in order: the library waits for missing numbers. Repeated, because a socket may lose some.
  ASSERT_TRUE(eventually([&] {
    const auto next = static_cast<std::uint32_t>(announced()) + 1;
    for (std::uint32_t i = next; i < next + 200 && i <= kMost + kTooMany; ++i)
      stranger.send(writer_announcement(1, i));
    return announced() == kMost;
  })) << announced();
  EXPECT_TRUE(eventually([&] {
    for (std::uint32_t i = 1; i <= kEnds; ++i)
      stranger.send(writer_end(1, i, kMost + kTooMany + i));
    for (std::uint32_t i = 1; i <= kTooMany; ++i)
      stranger.send(writer_announcement(1, kMost + i));
    return announced() == kMost + kTooMany - kEnds;
  })) << announced();
}

double seconds(int whose) {
  rusage usage{};
  EXPECT_EQ(::getrusage(whose, &usage), 0);
  const auto of = [](const timeval& it) {
    return static_cast<double>(it.tv_sec) + static_cast<double>(it.tv_usec) / 1e6;
  };
  return of(usage.ru_utime) + of(usage.ru_stime);
}

// The cost of this process without its main thread, which is the sender.
struct Cost {
  double processor = seconds(RUSAGE_SELF) - seconds(RUSAGE_THREAD);
  std::size_t resident = 0;  // octets

  Cost() {
    std::ifstream statm("/proc/self/statm");
    std::size_t size = 0;
    statm >> size >> resident;
    resident *= static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  }
};

// 2,000 forged participants, each with 20 writers of topics that have no reader here and 20 writers
// of topics that the gateway reads.
TEST(Discovery, AFloodOfInventedParticipantsAndEndpointsCostsABoundedAmount) {
  constexpr std::uint32_t kInvented = 2'000;
  constexpr std::uint32_t kWriters = 40;
  constexpr std::size_t kGrowth = (kIsSanitized ? 512U : 64U) << 20U;
  EventGateway gateway;
  ASSERT_TRUE(gateway.begins());
  dds::GatewayBridge& bridge = gateway.bridge();
  const Cost before;
  const SpdpSender stranger(metatraffic_port(domain(), 0));
  for (std::uint32_t i = 0; i < kInvented; ++i)
    stranger.send(announcement(i, 600));
  ASSERT_TRUE(eventually([&] {  // a socket may have lost some of them
    for (std::uint32_t i = 0; i < kInvented; ++i)
      stranger.send(announcement(i, 600));
    return bridge.guard_counters().of(dds::guard::Reason::participants) >= kInvented;
  }));
  for (std::uint32_t i = 0; i < kInvented; ++i) {
    for (std::uint32_t writer = 1; writer <= kWriters; ++writer) {
      const bool matches = writer % 2 == 0;
      stranger.send(writer_announcement(i, writer, matches ? "linegate/v1/OutputWrite" : "invented",
                                        matches ? "linegate::v1::OutputWrite" : "Invented"));
    }
    if (i % 200 == 0) {
      EXPECT_TRUE(gateway.is_received())
          << "a subscriber that was matched before has lost its place";
    }
  }
  EXPECT_TRUE(gateway.is_received());
  const Cost after;
  const std::size_t growth = std::max(after.resident, before.resident) - before.resident;
  std::printf(
      "2000 invented participants, 40 writers each: %zu found, %zu endpoints; the gateway "
      "grew by %.1f MB and took %.2f s of processor time\n",
      bridge.discovery().participants, bridge.guard_counters().endpoints,
      static_cast<double>(growth) / 1e6, after.processor - before.processor);
  EXPECT_LE(bridge.discovery().participants, bridge.discovery().most);
  EXPECT_LT(growth, kGrowth);
}

}  // namespace
}  // namespace linegate::test
