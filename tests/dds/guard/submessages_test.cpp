// SPDX-License-Identifier: Apache-2.0
// RTPS 2.3 9.4.5: fixed parts, lengths, sets and ranges of each submessage.
#include "bridges/dds/guard/submessages.h"

#include <gtest/gtest.h>

#include "tests/dds/guard/datagram.h"

namespace linegate::test {
namespace {

using dds::guard::Content;
using dds::guard::Reason;
using dds::guard::Submessage;

class SubmessageTest : public testing::TestWithParam<bool> {
 protected:
  const bool little = GetParam();

  // Checks the first submessage of the datagram.
  Reason check(Datagram datagram) {
    octets = std::move(datagram.get());
    content = Content{};
    const Reason reason = dds::guard::split(octets, dds::guard::kHeader, it);
    return reason == Reason::none ? dds::guard::check(it, content) : reason;
  }
  Reason check(unsigned kind, const Fields& body, unsigned flags = 0) {
    return check(Datagram().add(kind, body, flags));
  }
  // Every body that is shorter than the fixed part is rejected.
  void expect_cut(unsigned kind, const Fields& whole, std::size_t fixed, unsigned flags = 0) {
    for (std::size_t size = 1; size < fixed; ++size) {
      Fields cut(little);
      cut.octets({whole.get().begin(), whole.get().begin() + static_cast<std::ptrdiff_t>(size)});
      EXPECT_NE(check(kind, cut, flags), Reason::none) << size;
    }
    EXPECT_EQ(check(kind, whole, flags), Reason::none);
  }

  std::vector<std::uint8_t> octets;
  Submessage it;
  Content content;
};
INSTANTIATE_TEST_SUITE_P(OctetOrders, SubmessageTest, testing::Bool());

TEST_P(SubmessageTest, AHeaderIsRtpsOfMajorVersion2) {
  Datagram whole;
  EXPECT_TRUE(dds::guard::has_header(whole.get()));
  for (const std::size_t at : {0U, 1U, 2U, 3U, 4U}) {
    Datagram bad;
    bad.get()[at] ^= 1U;
    EXPECT_FALSE(dds::guard::has_header(bad.get())) << at;
  }
  whole.get().pop_back();
  EXPECT_FALSE(dds::guard::has_header(whole.get()));
}

TEST_P(SubmessageTest, ALengthLiesWithinTheDatagramAndEndsAtAMultipleOf4) {
  const Fields body = Fields(little).zeros(12);
  EXPECT_EQ(check(Datagram().add(0x0E, body)), Reason::none);
  EXPECT_EQ(it.body.size(), 12U);
  EXPECT_FALSE(it.open_end);
  EXPECT_EQ(check(Datagram().add(0x0E, body, 0, 13)), Reason::submessage);
  EXPECT_EQ(check(Datagram().add(0x0E, body, 0, 0xFFFF)), Reason::submessage);
  EXPECT_EQ(check(Datagram().add(0x55, Fields(little).zeros(12), 0, 7)), Reason::submessage);
  EXPECT_EQ(check(Datagram().add(0x55, Fields(little).zeros(7))), Reason::none);
}

TEST_P(SubmessageTest, ALengthOf0ExtendsToTheEndButForPadAndInfoTs) {
  EXPECT_EQ(check(Datagram().add(0x0E, Fields(little).zeros(12), 0, 0)), Reason::none);
  EXPECT_TRUE(it.open_end);
  EXPECT_EQ(it.body.size(), 12U);
  EXPECT_EQ(check(Datagram().add(0x01, Fields(little).zeros(12), 0, 0)), Reason::none);
  EXPECT_EQ(it.body.size(), 0U);
  EXPECT_EQ(check(Datagram().add(0x09, Fields(little).zeros(12), 0x02, 0)), Reason::none);
  EXPECT_EQ(it.body.size(), 0U);
}

TEST_P(SubmessageTest, AHeaderOfASubmessageIsNotCut) {
  for (const std::size_t size : {1U, 2U, 3U}) {
    Datagram datagram;
    datagram.get().resize(dds::guard::kHeader + size);
    EXPECT_EQ(check(datagram), Reason::submessage);
  }
}

TEST_P(SubmessageTest, InfoSubmessagesHaveTheirFixedPart) {
  expect_cut(0x09, Fields(little).zeros(8), 8);
  EXPECT_EQ(check(0x09, Fields(little), 0x02), Reason::none);  // invalidates the timestamp
  EXPECT_EQ(check(0x09, Fields(little)), Reason::submessage);
  expect_cut(0x0C, Fields(little).zeros(20), 20);
  expect_cut(0x0E, Fields(little).zeros(12), 12);
}

TEST_P(SubmessageTest, AckNackHasASetOfAtMost256Bits) {
  expect_cut(0x06, acknack(1, 0, kReader, kWriter, little), 24);
  // A preemptive ACKNACK.
  EXPECT_EQ(check(0x06, acknack(0, 0, kReader, kWriter, little)), Reason::none);
  EXPECT_EQ(check(0x06, acknack(0, 1, kReader, kWriter, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x06, acknack(-1, 0, kReader, kWriter, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x06, acknack((std::int64_t{1} << 48) + 1, 0, kReader, kWriter, little)),
            Reason::sequence_number);
  EXPECT_EQ(check(0x06, acknack(7, 256, kReader, kWriter, little)), Reason::none);
  EXPECT_EQ(content.reader, kReader);
  EXPECT_EQ(content.writer, kWriter);
  EXPECT_EQ(check(0x06, acknack(7, 257, kReader, kWriter, little)), Reason::sequence_set);
  const Fields lies = Fields(little).entity(1).entity(2).number(1).u32(64).zeros(4).u32(1);
  EXPECT_EQ(check(0x06, lies), Reason::sequence_set);
}

TEST_P(SubmessageTest, HeartbeatNamesARangeThatMayBeEmpty) {
  expect_cut(0x07, heartbeat(1, 5, little), 28);
  EXPECT_EQ(content.highest, 5);
  EXPECT_EQ(check(0x07, heartbeat(6, 5, little)), Reason::none);
  EXPECT_EQ(check(0x07, heartbeat(7, 5, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x07, heartbeat(0, 5, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x07, heartbeat(-1, 5, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x07, heartbeat(1, std::int64_t{1} << 62, little)), Reason::sequence_number);
}

TEST_P(SubmessageTest, GapNamesAStartAndASet) {
  expect_cut(0x08, gap(3, 9, 0, little), 28);
  EXPECT_EQ(content.highest, 8);
  EXPECT_EQ(check(0x08, gap(3, 9, 256, little)), Reason::none);
  EXPECT_EQ(content.highest, 8 + 256);
  EXPECT_EQ(check(0x08, gap(3, 9, 288, little)), Reason::sequence_set);
  EXPECT_EQ(check(0x08, gap(0, 9, 0, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x08, gap(9, 8, 0, little)), Reason::sequence_number);
  EXPECT_EQ(check(0x08, gap(9, 9, 0, little)), Reason::none);
  EXPECT_EQ(check(0x08, gap(1, std::int64_t{1} << 62, 0, little)), Reason::sequence_number);
}

TEST_P(SubmessageTest, FragmentAcknowledgementsNameFragmentsFrom1) {
  const auto nack = [&](std::uint32_t base, std::uint32_t bits) {
    return Fields(little)
        .entity(1)
        .entity(2)
        .number(4)
        .u32(base)
        .u32(bits)
        .zeros((bits + 31) / 32 * 4)
        .u32(1);
  };
  expect_cut(0x12, nack(1, 0), 28);
  EXPECT_EQ(check(0x12, nack(0, 1)), Reason::sequence_set);
  EXPECT_EQ(check(0x12, nack(1, 256)), Reason::none);
  EXPECT_EQ(check(0x12, nack(1, 257)), Reason::sequence_set);
  const auto beat = [&](std::int64_t number, std::uint32_t last) {
    return Fields(little).entity(1).entity(2).number(number).u32(last).u32(1);
  };
  expect_cut(0x13, beat(1, 1), 24);
  EXPECT_EQ(check(0x13, beat(0, 1)), Reason::sequence_number);
  EXPECT_EQ(check(0x13, beat(1, 0)), Reason::fragment);
}

TEST_P(SubmessageTest, DataPointsAtItsInlineQosWithinItself) {
  Fields whole = data(9, kWriter, little);
  EXPECT_EQ(check(0x15, whole), Reason::none);
  EXPECT_EQ(content.highest, 9);
  EXPECT_FALSE(content.has_data);
  for (std::size_t size = 1; size < 20; ++size) {
    Fields cut(little);
    cut.octets({whole.get().begin(), whole.get().begin() + static_cast<std::ptrdiff_t>(size)});
    EXPECT_EQ(check(0x15, cut), Reason::submessage) << size;
  }
  const auto skipping = [&](unsigned octets_to_inline_qos) {
    return Fields(little).u16(0).u16(octets_to_inline_qos).entity(0).entity(kWriter).number(1);
  };
  EXPECT_EQ(check(0x15, skipping(15)), Reason::submessage);
  EXPECT_EQ(check(0x15, skipping(17)), Reason::submessage);
  EXPECT_EQ(check(0x15, skipping(0xFFFF)), Reason::submessage);
  EXPECT_EQ(check(0x15, skipping(20).zeros(4)), Reason::none);
  EXPECT_EQ(check(0x15, data(0, kWriter, little)), Reason::sequence_number);
}

TEST_P(SubmessageTest, DataHasDataOrAKeyWithTheirEncapsulation) {
  const Fields four = data(1, kWriter, little).zeros(4);
  const Fields three = data(1, kWriter, little).zeros(3);
  EXPECT_EQ(check(0x15, four, kHasData), Reason::none);
  EXPECT_TRUE(content.has_data);
  EXPECT_EQ(content.payload.size(), 4U);
  EXPECT_EQ(check(0x15, four, kHasKey), Reason::none);
  EXPECT_FALSE(content.has_data);
  EXPECT_EQ(check(0x15, four, kHasData | kHasKey), Reason::submessage);
  EXPECT_EQ(check(0x15, three, kHasData), Reason::submessage);
  EXPECT_EQ(check(0x15, three, kHasKey), Reason::submessage);
}

TEST_P(SubmessageTest, InlineQosEndsWithASentinelWithinTheSubmessage) {
  const auto with = [&](const Fields& qos) {
    return check(0x15, data(1, kWriter, little).octets(qos.get()), kHasInlineQos);
  };
  const Fields hash = Fields(little).zeros(16);
  EXPECT_EQ(with(Fields(little).sentinel()), Reason::none);
  EXPECT_EQ(with(Fields(little).parameter(0x70, hash).sentinel().zeros(8)), Reason::none);
  EXPECT_EQ(content.payload.size(), 8U);
  EXPECT_EQ(with(Fields(little)), Reason::parameters);
  EXPECT_EQ(with(Fields(little).parameter(0x70, hash)), Reason::parameters);
  EXPECT_EQ(with(Fields(little).u16(0x70).u16(24).zeros(16).sentinel()), Reason::parameters);
  EXPECT_EQ(with(Fields(little).parameter(0x70, Fields(little).zeros(12)).sentinel()),
            Reason::parameters);
  EXPECT_EQ(with(Fields(little).u16(0x71).u16(0xFFFC)), Reason::parameters);
  EXPECT_EQ(with(Fields(little).u16(0x8001).u16(3).zeros(3).sentinel()), Reason::parameters);
}

class FragmentTest : public SubmessageTest {
 protected:
  Reason fragment(std::uint32_t first, unsigned count, unsigned size, std::uint32_t sample,
                  std::size_t payload) {
    return check(0x16, Fields(little)
                           .u16(0)
                           .u16(28)
                           .entity(0)
                           .entity(kWriter)
                           .number(6)
                           .u32(first)
                           .u16(count)
                           .u16(size)
                           .u32(sample)
                           .zeros(payload));
  }
};
INSTANTIATE_TEST_SUITE_P(OctetOrders, FragmentTest, testing::Bool());

TEST_P(FragmentTest, FragmentsMakeUpTheSample) {
  EXPECT_EQ(fragment(1, 1, 1024, 3000, 1024), Reason::none);
  EXPECT_EQ(content.highest, 6);
  EXPECT_EQ(fragment(2, 2, 1024, 3000, 3000 - 1024), Reason::none);
  EXPECT_EQ(fragment(3, 1, 1024, 3000, 952), Reason::none);
  EXPECT_EQ(fragment(3, 1, 1024, 3000, 951), Reason::fragment);
  EXPECT_EQ(fragment(3, 1, 1024, 2999, 952), Reason::none);  // with padding
  EXPECT_EQ(fragment(3, 1, 1024, 3000, 956), Reason::fragment);
  EXPECT_EQ(fragment(3, 2, 1024, 3000, 1976), Reason::fragment);
  EXPECT_EQ(fragment(4, 1, 1024, 3000, 1024), Reason::fragment);
  EXPECT_EQ(fragment(0xFFFFFFFF, 1, 1024, 3000, 1024), Reason::fragment);
}

TEST_P(FragmentTest, FragmentsAreCountedFrom1AndHaveASize) {
  EXPECT_EQ(fragment(0, 1, 1024, 3000, 1024), Reason::fragment);
  EXPECT_EQ(fragment(1, 0, 1024, 3000, 1024), Reason::fragment);
  for (const unsigned size : {0U, 1U, 2U, 3U, 5U})
    EXPECT_EQ(fragment(1, 1, size, 3000, size), Reason::fragment) << size;
}

TEST_P(FragmentTest, ASampleHasAtMost4MiB) {
  EXPECT_EQ(fragment(1, 1, 1024, 4U << 20U, 1024), Reason::none);
  EXPECT_EQ(fragment(1, 1, 1024, (4U << 20U) + 1, 1024), Reason::fragment);
  EXPECT_EQ(fragment(1, 1, 1024, 0x80000000, 1024), Reason::fragment);
  // A sample of one fragment is not fragmented.
  EXPECT_EQ(fragment(1, 1, 1024, 1024, 1024), Reason::fragment);
}

}  // namespace
}  // namespace linegate::test
