// SPDX-License-Identifier: Apache-2.0
// DDS-Security 1.1 7.3.6: order and lengths of protected submessages, and which submessages may be
// plain.
#include "bridges/dds/guard/protection.h"

#include <gtest/gtest.h>

#include "bridges/dds/guard/guard.h"

#include "tests/dds/guard/datagram.h"

namespace linegate::test {
namespace {

using dds::guard::Guard;
using dds::guard::Reason;
namespace entity = dds::guard::entity;

Fields crypto_header() {
  return Fields().zeros(20);
}
// length: the length field of the content, big-endian.
Fields content(std::uint32_t length, std::size_t octets) {
  return Fields(false).u32(length).zeros(octets);
}
Fields footer(std::uint32_t count, std::size_t macs) {
  return Fields(false).zeros(16).u32(count).zeros(20 * macs);
}

Reason judge(Datagram datagram, bool required = false) {
  Guard guard(required);
  return guard.judge(datagram.get(), 0).reason;
}

Datagram message(const Fields& body, const Fields& end = footer(0, 0)) {
  return Datagram().add(0x33, crypto_header()).add(0x30, body).add(0x34, end);
}
Datagram submessage(const Fields& body, const Fields& end = footer(0, 0)) {
  return Datagram().add(0x31, crypto_header()).add(0x30, body).add(0x32, end);
}

TEST(ProtectionTest, ProtectedMessagesAndSubmessagesPass) {
  for (const bool required : {false, true}) {
    EXPECT_EQ(judge(message(content(40, 40)), required), Reason::none);
    EXPECT_EQ(judge(submessage(content(40, 40)), required), Reason::none);
    EXPECT_EQ(judge(submessage(content(39, 40)), required), Reason::none);
    EXPECT_EQ(judge(message(content(40, 40), footer(2, 2)), required), Reason::none);
    EXPECT_EQ(judge(message(content(40, 40)).add(0x80, Fields().zeros(56)), required),
              Reason::none);
  }
}

TEST(ProtectionTest, AContentHasTheLengthThatItClaims) {
  for (const std::uint32_t claimed : {0U, 35U, 41U, 44U, 1000U, 0x7FFFFFFFU, 0xFFFFFFFFU}) {
    EXPECT_EQ(judge(message(content(claimed, 40))), Reason::protection) << claimed;
    EXPECT_EQ(judge(submessage(content(claimed, 40))), Reason::protection) << claimed;
  }
}

TEST(ProtectionTest, AFooterHasTheCodesThatItCounts) {
  EXPECT_EQ(judge(submessage(content(4, 4), footer(1, 0))), Reason::protection);
  EXPECT_EQ(judge(submessage(content(4, 4), footer(0xFFFFFFFF, 2))), Reason::protection);
  EXPECT_EQ(judge(submessage(content(4, 4), Fields().zeros(16))), Reason::protection);
}

TEST(ProtectionTest, ProtectedSubmessagesComeInTheirOrder) {
  const Fields header = crypto_header();
  const Fields body = content(4, 4);
  const Fields end = footer(0, 0);
  const auto order = [&](std::initializer_list<unsigned> kinds) {
    Datagram datagram;
    for (const unsigned kind : kinds) {
      const bool begins = kind == 0x31 || kind == 0x33;
      datagram.add(kind, begins ? header : kind == 0x30 ? body : kind == 0x01 ? Fields() : end);
    }
    return judge(datagram);
  };
  EXPECT_EQ(order({0x33, 0x30, 0x34}), Reason::none);
  EXPECT_EQ(order({0x31, 0x30, 0x32, 0x31, 0x30, 0x32}), Reason::none);
  EXPECT_EQ(order({0x33, 0x31, 0x30, 0x32, 0x34}), Reason::none);
  EXPECT_EQ(order({0x33, 0x01, 0x01, 0x34}), Reason::none);  // signed
  EXPECT_EQ(order({0x31, 0x01, 0x32}), Reason::none);
  for (const auto& wrong :
       std::initializer_list<std::initializer_list<unsigned>>{{0x30},
                                                              {0x32},
                                                              {0x34},
                                                              {0x31},
                                                              {0x33},
                                                              {0x33, 0x30},
                                                              {0x31, 0x30},
                                                              {0x31, 0x32},
                                                              {0x31, 0x31, 0x30, 0x32},
                                                              {0x31, 0x30, 0x30, 0x32},
                                                              {0x31, 0x01, 0x01, 0x32},
                                                              {0x31, 0x30, 0x34},
                                                              {0x33, 0x30, 0x30, 0x34},
                                                              {0x33, 0x31, 0x30, 0x34},
                                                              {0x33, 0x30, 0x34, 0x31, 0x30, 0x32},
                                                              {0x01, 0x33, 0x30, 0x34}})
    EXPECT_EQ(order(wrong), Reason::protection);
}

TEST(ProtectionTest, AHeaderIsWholeAndNoLengthIsLeftOut) {
  EXPECT_EQ(judge(Datagram()
                      .add(0x33, Fields().zeros(16))
                      .add(0x30, content(4, 4))
                      .add(0x34, footer(0, 0))),
            Reason::protection);
  EXPECT_EQ(judge(Datagram()
                      .add(0x31, crypto_header())
                      .add(0x30, content(4, 4))
                      .add(0x32, footer(0, 0), 0, 0)),
            Reason::protection);
}

TEST(ProtectionTest, WhereProtectionIsRequiredOnlyDiscoveryAndHandshakeArePlain) {
  Fields guid;
  for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(1), 0x000001C1))
    guid.u8(octet);
  const Fields list = Fields().u8(0).u8(3).u16(0).parameter(0x50, guid).sentinel();
  const Fields handshake = Fields().u8(0).u8(1).u16(0).zeros(96).string("dds").u32(0);
  const auto plain = [&](unsigned kind, const Fields& body, unsigned flags = 0) {
    EXPECT_EQ(judge(Datagram().add(kind, body, flags)), Reason::none) << kind;
    return judge(Datagram().add(kind, body, flags), true);
  };
  EXPECT_EQ(plain(0x09, Fields().zeros(8)), Reason::none);
  EXPECT_EQ(plain(0x0E, Fields().zeros(12)), Reason::none);
  EXPECT_EQ(plain(0x80, Fields().zeros(56)), Reason::none);
  EXPECT_EQ(plain(0x15, data(1, entity::kParticipants).octets(list.get()), kHasData), Reason::none);
  EXPECT_EQ(plain(0x15, data(1, entity::kStateless).octets(handshake.get()), kHasData),
            Reason::none);
  EXPECT_EQ(plain(0x15, data(1, entity::kSubscriptions).octets(list.get()), kHasData),
            Reason::unprotected);
  EXPECT_EQ(plain(0x15, data(1)), Reason::unprotected);
  EXPECT_EQ(plain(0x06, acknack(1, 0)), Reason::unprotected);
  EXPECT_EQ(plain(0x07, heartbeat(1, 1)), Reason::unprotected);
  EXPECT_EQ(plain(0x07, heartbeat(1, 1, true, entity::kParticipants)), Reason::unprotected);
  EXPECT_EQ(plain(0x08, gap(1, 2)), Reason::unprotected);
  EXPECT_EQ(plain(0x0C, Fields().zeros(20)), Reason::unprotected);
  EXPECT_EQ(plain(0x01, Fields()), Reason::unprotected);
}

TEST(ProtectionTest, WhereProtectionIsRequiredAParticipantDoesNotEndInPlain) {
  Fields guid;
  for (const std::uint8_t octet : dds::guard::make_guid(prefix_of(1), 0x000001C1))
    guid.u8(octet);
  const Fields list = Fields().u8(0).u8(3).u16(0).parameter(0x50, guid).sentinel();
  const auto participant = [&](unsigned status) {
    const Fields qos = Fields().parameter(0x71, Fields().zeros(3).u8(status)).sentinel();
    return data(1, entity::kParticipants).octets(qos.get()).octets(list.get());
  };
  const auto reason = [](const Fields& body, unsigned flags, bool required) {
    return judge(Datagram().add(0x15, body, flags), required);
  };
  EXPECT_EQ(reason(participant(0), kHasInlineQos | kHasData, true), Reason::none);
  for (const unsigned status : {1U, 2U, 3U}) {
    EXPECT_EQ(reason(participant(status), kHasInlineQos | kHasData, true), Reason::unprotected);
    EXPECT_EQ(reason(participant(status), kHasInlineQos | kHasKey, true), Reason::unprotected);
    EXPECT_EQ(reason(participant(status), kHasInlineQos | kHasData, false), Reason::none);
  }
}

}  // namespace
}  // namespace linegate::test
