// SPDX-License-Identifier: Apache-2.0
// Discovery samples: no parameter may claim more octets than it has.
#include "bridges/dds/guard/parameters.h"

#include <gtest/gtest.h>

#include "tests/dds/guard/datagram.h"

namespace linegate::test {
namespace {

using dds::guard::Announcement;
using dds::guard::Wire;

class ParameterTest : public testing::TestWithParam<bool> {
 protected:
  const bool little = GetParam();

  Fields fields() const { return Fields(little); }
  Fields encapsulation(unsigned big_endian) const {
    return Fields(little).u8(0).u8(big_endian + (little ? 1U : 0U)).u16(0);
  }
  bool takes(const Fields& list) {
    announced = Announcement{};
    const Fields payload = encapsulation(2).octets(list.get());
    return dds::guard::check_parameter_list(Wire(payload.get(), !little), announced);
  }
  bool takes(unsigned id, const Fields& value) {
    return takes(fields().parameter(id, value).sentinel());
  }
  Fields token(std::uint32_t count) const {
    return fields().string("DDS:Auth:PKI-DH:1.0").u32(count);
  }

  Announcement announced;
};
INSTANTIATE_TEST_SUITE_P(OctetOrders, ParameterTest, testing::Bool());

TEST_P(ParameterTest, AListHasAnEncapsulationThatSaysItIsOne) {
  EXPECT_TRUE(takes(fields().sentinel()));
  const Fields cdr = encapsulation(0).sentinel();
  EXPECT_FALSE(dds::guard::check_parameter_list(Wire(cdr.get(), little), announced));
  const Fields cut = fields().u8(0).u8(3);
  EXPECT_FALSE(dds::guard::check_parameter_list(Wire(cut.get(), little), announced));
}

TEST_P(ParameterTest, AListEndsWithASentinel) {
  EXPECT_FALSE(takes(fields()));
  EXPECT_FALSE(takes(fields().parameter(0x1D, fields().u32(0))));
  EXPECT_FALSE(takes(fields().u16(0x1D).u16(8).u32(0)));
  EXPECT_TRUE(takes(fields().parameter(0x1D, fields().u32(0)).sentinel().zeros(40)));
}

TEST_P(ParameterTest, AParameterOfFixedSizeHasIt) {
  const std::vector<std::pair<unsigned, std::size_t>> sizes = {
      {0x02, 8},  {0x15, 4},  {0x16, 4},  {0x1A, 12}, {0x1B, 12}, {0x1D, 4},
      {0x2F, 24}, {0x32, 24}, {0x33, 24}, {0x50, 16}, {0x58, 4},  {0x5A, 16}};
  for (const auto& [id, size] : sizes) {
    EXPECT_TRUE(takes(id, fields().zeros(size))) << id;
    EXPECT_FALSE(takes(id, fields().zeros(size - 4))) << id;
  }
  EXPECT_TRUE(takes(0x8123, fields()));  // a vendor-specific parameter
}

TEST_P(ParameterTest, AStringLiesWithinItsParameter) {
  for (const unsigned id : {0x05U, 0x07U, 0x62U, 0x2CU, 0x2DU, 0x2EU}) {
    EXPECT_TRUE(takes(id, fields().string("linegate/v1/Event"))) << id;
    EXPECT_FALSE(takes(id, fields().u32(9).zeros(8))) << id;
    EXPECT_FALSE(takes(id, fields().u32(0xFFFFFFFF).zeros(8))) << id;
    EXPECT_FALSE(takes(id, fields())) << id;
  }
}

TEST_P(ParameterTest, ASequenceOfStringsLiesWithinItsParameter) {
  EXPECT_TRUE(takes(0x29, fields().u32(2).string("a").string("press*")));
  EXPECT_TRUE(takes(0x29, fields().u32(0)));
  EXPECT_FALSE(takes(0x29, fields().u32(3).string("a").string("press*")));
  EXPECT_FALSE(takes(0x29, fields().u32(0x40000000).string("a")));
  EXPECT_TRUE(takes(0x35, fields().string("a").string("b").string("c").string("d").u32(0)));
  EXPECT_FALSE(takes(0x35, fields().string("a").string("b").string("c").u32(0)));
}

// Fast DDS reads a string up to a NUL, wherever that is.
TEST_P(ParameterTest, AStringEndsWithTheNulThatItsLengthCounts) {
  const Fields open = fields().u32(4).u32(0x61616161);
  for (const unsigned id : {0x05U, 0x07U, 0x62U}) {
    EXPECT_FALSE(takes(id, open)) << id;
    EXPECT_FALSE(takes(id, fields().u32(0).zeros(4))) << id;
  }
  EXPECT_FALSE(takes(0x29, fields().u32(1).octets(open.get())));
  EXPECT_FALSE(takes(0x29, fields().u32(1).u32(0)));
  EXPECT_FALSE(takes(0x35, fields().string("a").string("b").string("c").octets(open.get()).u32(0)));
}

TEST_P(ParameterTest, PropertiesTakeAtLeast16OctetsEach) {
  EXPECT_TRUE(takes(0x59, fields().u32(1).string("n").string("v")));
  EXPECT_FALSE(takes(0x59, fields().u32(2).string("n").string("v")));
  EXPECT_FALSE(takes(0x59, fields().u32(1U << 24U).string("n").string("v")));
  EXPECT_FALSE(takes(0x59, fields().u32(1).string("n").u32(0x7FFFFFFF)));
}

// Data representations and domains of data sharing: the library reads as many numbers as are
// claimed.
TEST_P(ParameterTest, ASequenceOfNumbersLiesWithinItsParameter) {
  for (const auto& [id, size] : {std::pair{0x73U, 2U}, {0x8006U, 8U}}) {
    EXPECT_TRUE(takes(id, fields().u32(0))) << id;
    EXPECT_TRUE(takes(id, fields().u32(4).zeros(4 * size))) << id;
    EXPECT_FALSE(takes(id, fields().u32(5).zeros(4 * size))) << id;
    EXPECT_FALSE(takes(id, fields().u32(0xFFFFFFFF).zeros(4 * size))) << id;
    EXPECT_FALSE(takes(id, fields())) << id;
  }
  EXPECT_TRUE(takes(0x74, fields().zeros(8)));
  EXPECT_FALSE(takes(0x74, fields()));
}

TEST_P(ParameterTest, AWriterAnnouncesItsPersistenceGuid) {
  EXPECT_TRUE(takes(fields().sentinel()));
  EXPECT_FALSE(announced.persistence);
  EXPECT_TRUE(takes(0x8002, fields().zeros(15).u8(7)));
  ASSERT_TRUE(announced.persistence);
  EXPECT_EQ(announced.persistence->at(15), 7);
  EXPECT_FALSE(takes(0x8002, fields().zeros(12)));
}

TEST_P(ParameterTest, ATokenHasAsManyPropertiesAsItSays) {
  for (const unsigned id : {0x1001U, 0x1002U, 0x1006U}) {
    EXPECT_TRUE(takes(id, token(0).u32(0))) << id;
    EXPECT_TRUE(takes(id, token(1).string("dds.cert.sn").string("CN=a").u32(0))) << id;
    EXPECT_FALSE(takes(id, token(1U << 24U).u32(0))) << id;
    EXPECT_FALSE(takes(id, token(0).u32(1U << 24U))) << id;
    EXPECT_FALSE(takes(id, token(0))) << id;
  }
}

TEST_P(ParameterTest, ASubscriptionAnnouncesItsEndpointAndReliability) {
  EXPECT_TRUE(takes(fields().sentinel()));
  EXPECT_FALSE(announced.endpoint);
  const auto reader = fields().zeros(15).u8(4);
  EXPECT_TRUE(takes(fields().parameter(0x5A, reader).sentinel()));
  ASSERT_TRUE(announced.endpoint);
  EXPECT_EQ(announced.endpoint->at(15), 4);
  EXPECT_FALSE(announced.reliable);
  EXPECT_TRUE(
      takes(fields().parameter(0x1A, fields().u32(2).zeros(8)).parameter(0x5A, reader).sentinel()));
  EXPECT_TRUE(announced.reliable);
  EXPECT_TRUE(takes(fields().parameter(0x1A, fields().u32(1).zeros(8)).sentinel()));
  EXPECT_FALSE(announced.reliable);
}

TEST_P(ParameterTest, MessagesOfLivelinessAndHandshakeLieWithinTheirSample) {
  const auto liveliness = [&](const Fields& body, unsigned representation = 0) {
    const Fields payload = encapsulation(representation).octets(body.get());
    return dds::guard::check_liveliness_message(Wire(payload.get(), little));
  };
  EXPECT_TRUE(liveliness(fields().zeros(16).u32(0)));
  EXPECT_TRUE(liveliness(fields().zeros(16).u32(4).zeros(4)));
  EXPECT_TRUE(liveliness(fields().zeros(16).u32(0), 2));  // as Fast DDS encodes it
  EXPECT_FALSE(liveliness(fields().zeros(16).u32(1), 2));
  EXPECT_FALSE(liveliness(fields().zeros(16).u32(0), 4));
  EXPECT_FALSE(liveliness(fields().zeros(16).u32(5).zeros(4)));
  EXPECT_FALSE(liveliness(fields().zeros(16)));
  const auto stateless = [&](const Fields& body) {
    const Fields payload = encapsulation(0).octets(body.get());
    return dds::guard::check_stateless_message(Wire(payload.get(), little));
  };
  const Fields head = fields().zeros(96).string("dds.sec.auth");
  EXPECT_TRUE(stateless(fields().octets(head.get()).u32(0)));
  EXPECT_TRUE(stateless(fields().octets(head.get()).u32(1).string("DDS:Auth").u32(0).u32(0)));
  EXPECT_FALSE(stateless(fields().octets(head.get()).u32(1)));
  EXPECT_FALSE(stateless(fields().octets(head.get()).u32(1U << 24U)));
  EXPECT_FALSE(
      stateless(fields().octets(head.get()).u32(1).string("DDS:Auth").u32(1U << 24U).u32(0)));
}

}  // namespace
}  // namespace linegate::test
