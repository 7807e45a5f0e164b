// SPDX-License-Identifier: Apache-2.0
// The certificate in a message of the authentication handshake: none can pass without being seen.
#include "bridges/dds/guard/handshake.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/dds/guard/guard.h"

#include "tests/dds/guard/datagram.h"

namespace linegate::test {
namespace {

using dds::guard::certificate_in;
using dds::guard::Guard;
using dds::guard::Octets;
using dds::guard::Reason;
namespace entity = dds::guard::entity;

const std::string kCertificate = "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n";

std::vector<std::uint8_t> octets_of(const std::string& text) {
  return {text.begin(), text.end()};
}

TEST(CertificateIn, TheOnlyOneOrNone) {
  const auto message = octets_of(std::string("c.id\0", 5) + kCertificate + "c.perm");
  const auto found = certificate_in(message);
  ASSERT_TRUE(found);
  EXPECT_EQ(std::string(found->begin(), found->end()), kCertificate + "c.perm");
  for (const char* text : {"", "-", "-----BEGIN", "-----END CERTIFICATE-----", "c.perm"}) {
    const auto none = certificate_in(octets_of(text));
    ASSERT_TRUE(none) << text;
    EXPECT_TRUE(none->empty()) << text;
  }
}

TEST(CertificateIn, NothingThatOpensslCouldReadInAnotherWay) {
  for (const std::string& text :
       {kCertificate + kCertificate, "-----BEGIN PKCS7-----\n" + kCertificate,
        kCertificate + "-----BEGIN X509 CERTIFICATE-----",
        std::string("-----BEGIN X509 CERTIFICATE-----\nAAAA"),
        std::string("-----BEGIN TRUSTED CERTIFICATE-----\nAAAA"), std::string("-----BEGIN "),
        std::string("-----BEGIN CERTIFICATE----")})
    EXPECT_FALSE(certificate_in(octets_of(text))) << text;
}

// A message of the handshake with that octets in its class.
Datagram handshake(const std::string& text) {
  const Fields payload = Fields()
                             .u8(0)
                             .u8(1)
                             .u16(0)
                             .zeros(96)
                             .string("dds.sec.auth")
                             .u32(1)
                             .string(text)
                             .u32(0)
                             .u32(0);
  return Datagram().add(0x15,
                        Fields()
                            .u16(0)
                            .u16(16)
                            .entity(0x000201C4)
                            .entity(entity::kStateless)
                            .number(1)
                            .octets(payload.get()),
                        0x04);
}

TEST(CertificateIn, AHandshakeIsDroppedUnlessItsCertificateIsAccepted) {
  bool accepts = false;
  std::vector<std::string> seen;
  Guard guard(true);
  guard.watch_certificates([&](Octets pem) {
    seen.emplace_back(pem.begin(), pem.begin() + 27);
    return accepts;
  });
  EXPECT_EQ(guard.judge(handshake("none").get(), 0).reason, Reason::none);
  EXPECT_TRUE(seen.empty());
  EXPECT_EQ(guard.judge(handshake(kCertificate).get(), 0).reason, Reason::discovery);
  accepts = true;
  EXPECT_EQ(guard.judge(handshake(kCertificate).get(), 0).reason, Reason::none);
  EXPECT_EQ(seen, std::vector<std::string>(2, "-----BEGIN CERTIFICATE-----"));
  EXPECT_EQ(guard.judge(handshake(kCertificate + kCertificate).get(), 0).reason, Reason::discovery);
  EXPECT_EQ(seen.size(), 2U);
  Guard without(true);
  EXPECT_EQ(without.judge(handshake(kCertificate + kCertificate).get(), 0).reason, Reason::none);
}

}  // namespace
}  // namespace linegate::test
