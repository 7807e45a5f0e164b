// SPDX-License-Identifier: Apache-2.0
// Whole datagrams that the guard rewrites before it passes them on, compared octet by octet.
#include <vector>

#include "tests/dds/guard/guard_fixture.h"

namespace linegate::test {
namespace {

using dds::guard::Reason;
namespace entity = dds::guard::entity;

Fields range(std::int64_t start, std::int64_t base, bool little) {
  return gap(start, base, 0, little, kWriter, kReader);
}

class PassedOnTest : public GuardTest {
 protected:
  std::vector<std::uint8_t> pass(Datagram datagram) {
    EXPECT_EQ(guard.judge(datagram.get(), now, {}, &written).reason, Reason::none);
    return {written.octets().begin(), written.octets().end()};
  }
};

// --- this process --------------------------------------------------------------------------------

TEST_F(PassedOnTest, WhatNamesAWriterOfThisProcessIsLeftOut) {
  dds::guard::Prefix own = prefix_of(7);
  const auto all = [&](const dds::guard::Prefix& from) {
    return Datagram(from)
        .add(0x09, Fields().u32(1).u32(0))
        .add(0x15, data(1))
        .add(0x07, heartbeat(1, 1))
        .add(0x08, range(2, 3, true))
        .add(0x16, fragment_of(kWriter, 3, 128))
        .add(0x13, Fields().entity(0).entity(kWriter).number(3).u32(1).u32(1))
        .add(0x06, acknack(1, 32))
        .add(0x15, data(1, entity::kStateless).zeros(8));
  };
  EXPECT_GT(pass(all(own)).size(), all(own).get().size()) << "set_process_of() was not called yet";
  own[11] = 99;  // a participant of this process
  guard.set_process_of(prefix_of(7));
  EXPECT_EQ(pass(all(own)), Datagram(own)
                                .add(0x09, Fields().u32(1).u32(0))
                                .add(0x06, acknack(1, 32))
                                .add(0x15, data(1, entity::kStateless).zeros(8))
                                .get());
  own[7] = 99;  // a participant of another process
  EXPECT_GT(pass(all(own)).size(), all(own).get().size());
}

// --- GAPs ----------------------------------------------------------------------------------------

Fields gap_with(std::int64_t start, std::int64_t base, std::uint32_t bits,
                std::initializer_list<std::uint32_t> bitmap, bool little) {
  Fields out(little);
  out.entity(kReader).entity(kWriter).number(start).number(base).u32(bits);
  for (const std::uint32_t word : bitmap)
    out.u32(word);
  return out;
}

TEST_F(PassedOnTest, AGapIsPassedOnAsItsRanges) {
  for (const bool little : {true, false}) {
    EXPECT_EQ(pass(Datagram().add(0x08, range(3, 9, little))),
              Datagram().add(0x08, range(3, 9, little)).get());
    // 8 is adjacent to the range; 10 and 11; 40.
    EXPECT_EQ(pass(Datagram()
                       .add(0x08, gap_with(3, 8, 33, {0xB0000000, 0x80000000}, little))
                       .add(0x07, heartbeat(1, 99, little))),
              Datagram()
                  .add(0x08, range(3, 9, little))
                  .add(0x08, range(10, 12, little))
                  .add(0x08, range(40, 41, little))
                  .add(0x07, heartbeat(1, 99, little))
                  .get());
    // A GAP with a bitmap alone. Bits beyond numBits are ignored.
    EXPECT_EQ(pass(Datagram().add(0x08, gap_with(5, 5, 2, {0x70000000}, little))),
              Datagram().add(0x08, range(6, 7, little)).get());
    EXPECT_EQ(pass(Datagram().add(0x08, gap_with(5, 5, 2, {0}, little))), Datagram().get());
    // Length 0: the last submessage of the datagram.
    EXPECT_EQ(pass(Datagram().add(0x08, gap_with(4, 5, 2, {0x40000000}, little), 0, 0)),
              Datagram().add(0x08, range(4, 5, little)).add(0x08, range(6, 7, little)).get());
  }
}

TEST_F(PassedOnTest, ABoundedNumberOfGapsIsPassedOn) {
  constexpr std::uint32_t kHoles = 0x55555555;
  Datagram datagram;
  for (int i = 0; i < 9; ++i)
    datagram.add(
        0x08, gap_with(1, 2, 256, {kHoles, kHoles, kHoles, kHoles, kHoles, kHoles, kHoles, kHoles},
                       true));
  EXPECT_EQ(pass(datagram).size(), 20U + 512 * 32);
  EXPECT_EQ(pass(Datagram().add(0x08, range(1, 2, true))).size(), 20U + 32)
      << "the bound applies to each datagram";
}

// --- parameters ----------------------------------------------------------------------------------

Fields list_with(unsigned id, unsigned other, bool little) {
  return Fields(little)
      .parameter(0x05, Fields(little).string("topic"))
      .parameter(id, Fields(little).u32(0xFFFFFFFF).u32(2))
      .parameter(other, Fields(little).u32(7))
      .sentinel();
}

TEST_F(PassedOnTest, TypesOfAnnouncementsArePadding) {
  const auto announced = [](unsigned id, unsigned other, bool little, std::uint32_t writer) {
    return Datagram()
        .add(0x09, Fields(little).u32(1).u32(0))
        .add(0x15,
             data(1, writer, little)
                 .u8(0)
                 .u8(little ? 3 : 2)
                 .u16(0)
                 .octets(list_with(id, other, little).get()),
             kHasData);
  };
  for (const bool little : {true, false}) {
    for (const std::uint32_t writer : {entity::kPublications, entity::kSubscriptions}) {
      for (const unsigned id : {0x69U, 0x72U, 0x75U}) {
        EXPECT_EQ(pass(announced(id, 0x43, little, writer)),
                  pass(announced(0, 0x43, little, writer)));
        EXPECT_EQ(pass(announced(0x43, id, little, writer)),
                  pass(announced(0x43, 0, little, writer)));
      }
    }
    EXPECT_EQ(pass(announced(0x69, 0x43, little, kWriter)),
              announced(0x69, 0x43, little, kWriter).get());
  }
}

TEST_F(PassedOnTest, KeyHashesOfFragmentsArePadding) {
  const auto fragment = [](unsigned id, bool little) {
    const Fields key = Fields(little).u32(1).u32(2).u32(3).u32(4);
    return Datagram()
        .add(0x09, Fields(little).u32(1).u32(0))
        .add(0x16,
             Fields(little)
                 .u16(0)
                 .u16(28)
                 .entity(0)
                 .entity(kWriter)
                 .number(1)
                 .u32(1)
                 .u16(1)
                 .u16(64)
                 .u32(128)
                 .octets(Fields(little).parameter(id, key).sentinel().get())
                 .zeros(64),
             kHasInlineQos);
  };
  for (const bool little : {true, false}) {
    EXPECT_EQ(pass(fragment(0x70, little)), fragment(0, little).get());
    EXPECT_EQ(pass(fragment(0x71, little)), fragment(0x71, little).get());
  }
}

}  // namespace
}  // namespace linegate::test
