// SPDX-License-Identifier: Apache-2.0
// Which octets of a TCP connection reach Fast DDS: RTCP messages as its own peers send them.
#include "bridges/dds/guard/rtcp_stream.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

using Message = std::vector<std::uint8_t>;

constexpr std::size_t kLargest = 65'500;  // maxMessageSize of Fast DDS
constexpr std::size_t kAtLength = 4, kAtPort = 12, kAtControl = 14;

template <class Number>
void put(Message& to, std::size_t at, Number value) {
  std::memcpy(to.data() + at, &value, sizeof value);
}

Message message(std::uint16_t port, const Message& body) {
  Message out{'R', 'T', 'C', 'P'};
  out.resize(kAtControl);
  put(out, kAtLength, static_cast<std::uint32_t>(kAtControl + body.size()));
  put(out, kAtPort, port);
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

Message datagram(std::size_t size) {
  return message(7411, Message(size, 0x55));
}

// rest: what follows the 16 octets that all control messages have.
Message control(std::uint8_t kind, const Message& rest) {
  Message body(16);
  body[0] = kind;
  put(body, 2, static_cast<std::uint16_t>(body.size() + rest.size()));
  body.insert(body.end(), rest.begin(), rest.end());
  return message(0, body);
}

Message content(const Message& octets) {
  Message out(6);
  put(out, 2, static_cast<std::uint32_t>(octets.size()));
  out.insert(out.end(), octets.begin(), octets.end());
  return out;
}

Message with_code(const Message& rest) {
  Message out(4);
  out.insert(out.end(), rest.begin(), rest.end());
  return out;
}

// A sequence of `elements` 16-bit numbers, of which `present` are there.
Message ports(bool little, std::uint32_t elements, std::size_t present) {
  Message out{0, static_cast<std::uint8_t>(little ? 1 : 0), 0, 0};
  for (unsigned i = 0; i < 4; ++i)
    out.push_back(static_cast<std::uint8_t>(elements >> 8U * (little ? i : 3 - i)));
  out.resize(out.size() + 2 * present);
  return content(out);
}

const Message kBind = content(Message(32));  // ConnectionRequest_t
const Message kPort = content(Message(6));   // OpenLogicalPortRequest_t

bool accepts(const Message& octets) {
  return RtcpStream(kLargest).take(octets);
}

// All messages that Fast DDS 2.9.1 sends.
std::vector<Message> sent_by_the_library() {
  return {control(0xD1, kBind),
          control(0xE1, with_code(content(Message(28)))),
          control(0xD2, kPort),
          control(0xE2, Message(4)),
          control(0xD3, ports(true, 3, 3)),
          control(0xE3, with_code(ports(false, 2, 2))),
          control(0xE3, with_code(ports(true, 0, 0))),
          control(0xD4, content(Message(28))),
          control(0xE4, Message(4)),
          control(0xD5, kPort),
          datagram(1),
          datagram(200),
          datagram(0),
          datagram(kLargest),
          control(0xD6, {})};
}

TEST(RtcpStream, MessagesOfTheLibraryPassInAnyPieces) {
  Message all;
  for (const Message& each : sent_by_the_library()) {
    EXPECT_TRUE(accepts(each));
    all.insert(all.end(), each.begin(), each.end());
  }
  for (const std::size_t piece : {std::size_t{1}, std::size_t{3}, std::size_t{14}, all.size()}) {
    RtcpStream stream(kLargest);
    for (std::size_t at = 0; at < all.size(); at += piece)
      ASSERT_TRUE(stream.take(Octets(all).subspan(at, std::min(piece, all.size() - at))))
          << piece << ' ' << at;
  }
}

TEST(RtcpStream, OtherOctetsAreRefusedFromTheFirstOneOn) {
  for (std::size_t i = 0; i < 4; ++i) {
    Message wrong = datagram(20);
    wrong[i] ^= 1U;
    RtcpStream stream(kLargest);
    EXPECT_TRUE(stream.take(datagram(20)));
    EXPECT_TRUE(stream.take(Octets(wrong).first(i)));
    EXPECT_FALSE(stream.take(Octets(wrong).subspan(i, 1)));
    EXPECT_FALSE(stream.take(datagram(20))) << "nor what follows";
  }
}

// With these the library skips up to 4 GiB, or loops for ever.
TEST(RtcpStream, LengthsOutsideOfTheBufferAreRefusedBeforeTheBody) {
  for (const std::uint32_t length : {0U, 13U, 14U + 65'501U, 1'346'589'778U, 0xFFFF'FFFFU}) {
    Message wrong = datagram(0);
    put(wrong, kAtLength, length);
    EXPECT_FALSE(accepts(wrong)) << length;
  }
  EXPECT_FALSE(RtcpStream(100).take(datagram(101)));
  EXPECT_TRUE(RtcpStream(100).take(datagram(100)));
}

// The library reads the fields of a shorter one from the message before, and computes a negative
// length from them.
TEST(RtcpStream, ControlMessagesWithoutTheirFieldsAreRefused) {
  for (std::size_t size = 0; size < 16; ++size) {
    Message body(size);
    if (size >= 4)
      put(body, 2, static_cast<std::uint16_t>(size));
    EXPECT_FALSE(accepts(message(0, body))) << size;
  }
}

TEST(RtcpStream, ControlMessagesOfAnotherLengthAreRefused) {
  for (const Message& each : sent_by_the_library()) {
    if (each[kAtPort] != 0 || each[kAtPort + 1] != 0)
      continue;
    Message wrong = each;
    ++wrong[kAtControl + 2];
    EXPECT_FALSE(accepts(wrong)) << "its length is that of the body " << int{each[kAtControl]};
    const Message body(each.begin() + kAtControl, each.end());
    Message longer(body.begin() + 16, body.end());
    longer.push_back(0);
    EXPECT_FALSE(accepts(control(each[kAtControl], longer))) << int{each[kAtControl]};
  }
}

TEST(RtcpStream, ContentThatIsMissingOrClaimsAnotherLengthIsRefused) {
  for (const std::uint8_t kind : Message{0xD1, 0xD2, 0xD3, 0xD4, 0xD5, 0xE1, 0xE3}) {
    const bool response = kind >= 0xE0;
    const auto with = [&](Message octets) {
      return control(kind, response ? with_code(octets) : octets);
    };
    Message valid = kind == 0xD3 || kind == 0xE3 ? ports(true, 1, 1) : kBind;
    EXPECT_TRUE(accepts(with(valid))) << int{kind};
    for (std::size_t size = 0; size < 6; ++size)
      EXPECT_FALSE(accepts(with(Message(size)))) << int{kind} << ' ' << size;
    for (const std::uint32_t length : {0U, 0xFFFF'FFFCU}) {
      put(valid, 2, length);
      EXPECT_FALSE(accepts(with(valid))) << int{kind};
    }
  }
  EXPECT_FALSE(accepts(control(0xE1, {}))) << "no code";
  EXPECT_FALSE(accepts(control(0xE2, {})));
}

// The library would allocate memory for them first.
TEST(RtcpStream, SequencesThatClaimMoreElementsThanTheyHaveAreRefused) {
  for (const bool little : {true, false}) {
    EXPECT_TRUE(accepts(control(0xD3, ports(little, 5, 5))));
    EXPECT_FALSE(accepts(control(0xD3, ports(little, 6, 5))));
    EXPECT_FALSE(accepts(control(0xD3, ports(little, 0xFFFF'FFFF, 5))));
    EXPECT_FALSE(accepts(control(0xE3, with_code(ports(little, 0x8000'0000, 5)))));
  }
  EXPECT_FALSE(accepts(control(0xD3, content(Message(7)))));
}

TEST(RtcpStream, UnknownControlMessagesAreRefused) {
  for (const std::uint8_t kind : Message{0x00, 0xD0, 0xD7, 0xE0, 0xE5, 0xFF})
    EXPECT_FALSE(accepts(control(kind, kBind))) << int{kind};
}

// The library copies 10 octets from behind the message.
TEST(RtcpStream, ControlMessagesLeaveRoomInTheBuffer) {
  constexpr std::size_t kContent = 100;
  const Message longest = control(0xD1, content(Message(kContent)));
  const std::size_t body = longest.size() - kAtControl;
  EXPECT_TRUE(RtcpStream(body + 10).take(longest));
  EXPECT_FALSE(RtcpStream(body + 9).take(longest));
}

TEST(RtcpStream, AConnectionThatBeginsWithABindRequestIsAccepted) {
  RtcpStream accepted(kLargest);
  EXPECT_FALSE(accepted.is_accepted());
  EXPECT_TRUE(accepted.take(control(0xD1, kBind)));
  EXPECT_TRUE(accepted.is_accepted());
  EXPECT_TRUE(accepted.take(control(0xD2, kPort)));
  EXPECT_TRUE(accepted.take(datagram(20)));
  EXPECT_TRUE(accepted.is_accepted());

  RtcpStream opened(kLargest);
  EXPECT_TRUE(opened.take(control(0xE1, with_code(content(Message(28))))));
  EXPECT_TRUE(opened.take(control(0xD1, kBind)));
  EXPECT_FALSE(opened.is_accepted());

  RtcpStream unbound(kLargest);
  EXPECT_TRUE(unbound.take(datagram(20)));
  EXPECT_TRUE(unbound.take(control(0xD1, kBind)));
  EXPECT_FALSE(unbound.is_accepted());
}

}  // namespace
}  // namespace linegate::dds::guard
