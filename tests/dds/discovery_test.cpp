// Participants that somebody invents take a bounded number of places, and nobody's who is there.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/dds/publisher.h"

#include "tests/dds/fixtures.h"

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

// 127.0.0.1 and a port on which nobody listens, as Locator_t.
std::string nowhere() {
  std::string out;
  append(out, 1, 4);
  append(out, 9, 4);
  out += std::string(12, '\0') + "\x7F" + std::string(2, '\0') + "\x01";
  return out;
}

// The announcement (SPDP) of a participant that does not exist, and is gone after its lease.
std::string announcement(std::uint32_t number, std::uint32_t lease_seconds) {
  using namespace std::string_literals;
  std::string prefix = "\x01\x0F"s + "invent"s;
  append(prefix, number, 4);
  std::string parameters = "\0\x03\0\0"s;  // PL_CDR_LE
  append_parameter(parameters, 0x0015, "\x02\x03\0\0"s);
  append_parameter(parameters, 0x0016, "\x01\x0F\0\0"s);
  append_parameter(parameters, 0x0050, prefix + "\0\0\x01\xC1"s);
  append_parameter(parameters, 0x0032, nowhere());
  append_parameter(parameters, 0x0031, nowhere());
  std::string lease;
  append(lease, lease_seconds, 4);
  append(lease, 0, 4);
  append_parameter(parameters, 0x0002, lease);
  append_parameter(parameters, 0x0058, "\x3F\x0C\0\0"s);
  append_parameter(parameters, 0x0001, "");
  std::string data = "\0\0\x10\0"s + "\0\x01\0\xC7"s + "\0\x01\0\xC2"s;
  append(data, 0, 4);
  append(data, 1, 4);
  data += parameters;
  std::string out = "RTPS\x02\x03\x01\x0F"s + prefix + "\x15\x05"s;
  append(out, data.size(), 2);
  return out + data;
}

class SpdpSender {
 public:
  explicit SpdpSender(std::uint16_t port) {
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

TEST(Discovery, InventedParticipantsTakeABoundedNumberOfPlaces) {
  constexpr std::size_t kPlaces = 8;
  dds::GatewayOptions options{known::kGateway, 1, domain(), LOOPBACK_PROFILES, {known::kLine}};
  options.participants = kPlaces;
  auto gateway = dds::GatewayBridge::make(options);
  ASSERT_TRUE(gateway.ok());
  dds::GatewayBridge& bridge = **gateway.value;
  EXPECT_EQ(bridge.discovery().most, kPlaces);
  Peer subscriber("subscriber");
  ASSERT_EQ(subscriber.expect("ready"), "ready");
  std::uint64_t number = 0;
  const auto hears = [&] {
    ++number;
    EXPECT_TRUE(bridge.publish(known::kLine, known::event(number), "text"));
    return subscriber.expect("event " + std::to_string(number)) != "";
  };
  ASSERT_TRUE(hears());
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
  EXPECT_TRUE(hears()) << "a subscriber that was matched before has lost its place";
  EXPECT_LE(bridge.discovery().participants, kPlaces);
  EXPECT_LE(bridge.discovery().discovered - bridge.discovery().gone, kPlaces);

  // When the lease of the invented ones has passed there is room again.
  EXPECT_TRUE(eventually([&] { return bridge.discovery().participants == 1; }, kDeadline * 3));
  EXPECT_TRUE(hears());
  Peer late("subscriber");
  ASSERT_EQ(late.expect("ready"), "ready");
  EXPECT_EQ(late.expect("event " + std::to_string(number)), "event " + std::to_string(number));
}

}  // namespace
}  // namespace linegate::test
