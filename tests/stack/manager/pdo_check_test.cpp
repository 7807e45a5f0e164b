// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/pdo_check.h"

#include <map>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

#include "tests/stack/manager/numbers.h"

namespace linegate::manager {
namespace {

AssumedPdo pdo(std::uint16_t record, std::uint32_t cob_id, std::uint32_t object) {
  const auto mapping = static_cast<std::uint16_t>(record + 0x200);
  return {.parameters = {{{record, 1}, number(cob_id)},
                         {{record, 2}, number(255, 1)},
                         {{mapping, 0}, number(1, 1)},
                         {{mapping, 1}, number(object)}},
          .remedy = {{{record, 1}, number(cob_id | 0x8000'0000)},
                     {{mapping, 0}, number(0, 1)},
                     {{mapping, 1}, number(object)},
                     {{mapping, 0}, number(1, 1)},
                     {{record, 2}, number(255, 1)},
                     {{record, 1}, number(cob_id)}}};
}

// A node with these parameters.
class PdoCheckTest : public testing::Test {
 protected:
  std::string run(PdoCheck& check) {
    std::string out;
    while (!check.done()) {
      const TaskStep step = check.step();
      char text[48];
      std::snprintf(text, sizeof text, step.write ? "%04X:%u=%llX " : "?%04X:%u ",
                    unsigned{step.address.index}, unsigned{step.address.sub},
                    static_cast<unsigned long long>(load_le(std::span(step.data))));
      out += text;
      const auto refusal = refused_.find(step.address);
      if (refusal != refused_.end()) {
        check.take(refusal->second, {});
      } else if (step.write) {
        has_[step.address] = step.data;
        check.take(AbortCode::none, {});
      } else {
        check.take(AbortCode::none, has_[step.address]);
      }
    }
    return out;
  }

  std::map<od::Address, std::vector<std::byte>> has_{{{0x1800, 1}, number(0x185)},
                                                     {{0x1800, 2}, number(255, 1)},
                                                     {{0x1A00, 0}, number(1, 1)},
                                                     {{0x1A00, 1}, number(0x6000'0108)}};
  std::map<od::Address, AbortCode> refused_;
  const std::vector<AssumedPdo> pdos_{pdo(0x1800, 0x185, 0x6000'0108)};
};

TEST_F(PdoCheckTest, APdoThatIsAsExpectedIsReadAlone) {
  PdoCheck check(pdos_, {});
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
  EXPECT_FALSE(check.fault());
}

TEST_F(PdoCheckTest, APdoThatDiffersIsWritten) {
  has_[{0x1A00, 1}] = number(0x6000'0208);
  PdoCheck check(pdos_, {});
  EXPECT_EQ(run(check),
            "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 "
            "1800:1=80000185 1A00:0=0 1A00:1=60000108 1A00:0=1 1800:2=FF 1800:1=185 "
            "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
  EXPECT_FALSE(check.fault());
}

// A device may acknowledge a write and ignore it.
TEST_F(PdoCheckTest, TwoCorrectionsWithoutEffectAreAFault) {
  PdoCheck check(pdos_, {});
  unsigned writes = 0;
  while (!check.done()) {
    const TaskStep step = check.step();
    writes += step.write ? 1U : 0U;
    const bool is_entry = step.address == od::Address{0x1A00, 1};
    check.take(AbortCode::none, step.write ? std::vector<std::byte>{}
                                : is_entry ? number(0x6000'0208)
                                           : has_[step.address]);
  }
  EXPECT_EQ(check.fault(), (Difference{.object = {0x1A00, 1},
                                       .expected = number(0x6000'0108),
                                       .found = number(0x6000'0208)}));
  EXPECT_EQ(writes, 2 * pdos_[0].remedy.size());
}

// It was switched off and on, and its boot-up message has not reached the bus yet.
TEST_F(PdoCheckTest, ANodeThatHasItsStoredValuesAgainIsCorrectedAgain) {
  has_[{0x1A00, 1}] = number(0x6000'0208);
  PdoCheck check(pdos_, {});
  for (bool written = false; !written || check.step().write;) {
    const TaskStep step = check.step();
    written = step.write;
    check.take(AbortCode::none, step.write ? std::vector<std::byte>{} : has_[step.address]);
  }
  const std::string after = run(check);
  EXPECT_NE(after.find("1A00:1=60000108"), std::string::npos) << after;
  EXPECT_FALSE(check.fault());
}

// CiA 301 7.5.2.37: bits 0 to 29 must not change while the PDO exists; bit 30 is the device's.
TEST_F(PdoCheckTest, ACobIdIsSwitchedOffAsItIsAndKeepsItsRtrBit) {
  has_[{0x1800, 1}] = number(0x4000'01FF);
  PdoCheck check(pdos_, {});
  EXPECT_EQ(run(check),
            "?1800:1 1800:1=C00001FF 1A00:0=0 1A00:1=60000108 1A00:0=1 1800:2=FF 1800:1=40000185 "
            "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
  EXPECT_FALSE(check.fault());
}

// PDO 2 is not in the image.
TEST_F(PdoCheckTest, AnotherPdoOnACobIdOfTheImageIsSwitchedOff) {
  const auto taken = std::make_shared<const CobIds>(CobIds{0x185, 0x186});
  const AssumedPdo other{.parameters = {{{0x1801, 1}, number(0x8000'0000)}},
                         .remedy = {{{0x1801, 1}, number(0x8000'0000)}},
                         .taken = taken};
  for (const std::uint32_t harmless : {0x8000'0186U, 0x285U, 0x2000'0186U}) {
    has_[{0x1801, 1}] = number(harmless);
    PdoCheck check({other}, {});
    EXPECT_EQ(run(check), "?1801:1 ") << std::hex << harmless;
    EXPECT_FALSE(changes_pdo(std::vector{other}, {0x1801, 1}, number(harmless)));
  }
  has_[{0x1801, 1}] = number(0x4000'0186);
  PdoCheck check({other}, {});
  EXPECT_EQ(run(check), "?1801:1 1801:1=C0000186 ?1801:1 ");
  EXPECT_FALSE(check.fault());
  EXPECT_TRUE(changes_pdo(std::vector{other}, {0x1801, 1}, number(0x186)));
  EXPECT_TRUE(changes_pdo(std::vector{other}, {0x1801, 1}, {})) << "a transfer in segments";
}

TEST_F(PdoCheckTest, TheNextPdoIsReadAfterOneThatWasWritten) {
  has_[{0x1800, 1}] = number(0x8000'0185);
  has_[{0x1400, 1}] = number(0x205);
  refused_ = {{{0x1400, 2}, AbortCode::no_sub_index}};
  has_[{0x1600, 0}] = number(1, 1);
  has_[{0x1600, 1}] = number(0x6200'0108);
  PdoCheck check({pdo(0x1800, 0x185, 0x6000'0108), pdo(0x1400, 0x205, 0x6200'0108)}, {});
  EXPECT_EQ(run(check),
            "?1800:1 1800:1=80000185 1A00:0=0 1A00:1=60000108 1A00:0=1 1800:2=FF 1800:1=185 "
            "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 "
            "?1400:1 ?1400:2 ?1600:0 ?1600:1 ");
  EXPECT_FALSE(check.fault());
}

TEST_F(PdoCheckTest, ParametersThatCannotBeReadCountAsExpected) {
  refused_ = {{{0x1800, 2}, AbortCode::no_sub_index},
              {{0x1A00, 0}, AbortCode::no_object},
              {{0x1A00, 1}, AbortCode::no_object}};
  PdoCheck check(pdos_, {});
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
  EXPECT_FALSE(check.fault());
}

// A node that is still starting may answer so.
TEST_F(PdoCheckTest, WhatIsRefusedForNowIsNotKnown) {
  for (const AbortCode abort : {AbortCode::device_state, AbortCode::local_control,
                                AbortCode::general, AbortCode::out_of_memory}) {
    refused_ = {{{0x1A00, 1}, abort}};
    PdoCheck check(pdos_, {});
    EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
    EXPECT_TRUE(check.fault());
    EXPECT_TRUE(check.may_succeed_later());
  }
}

TEST_F(PdoCheckTest, AReadThatIsNotAnsweredIsRepeatedOnce) {
  PdoCheck check(pdos_, {});
  check.take(AbortCode::timeout, {});
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
  EXPECT_FALSE(check.fault());
  PdoCheck another(pdos_, {});
  another.take(AbortCode::timeout, {});
  another.take(AbortCode::none, number(0x185));
  another.take(AbortCode::timeout, {});
  EXPECT_FALSE(another.done()) << "the next parameter is repeated, too";
}

TEST_F(PdoCheckTest, TwoLostAnswersEndIt) {
  refused_ = {{{0x1800, 2}, AbortCode::timeout}};
  PdoCheck check(pdos_, {});
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1800:2 ");
  EXPECT_EQ(
      check.fault(),
      (Difference{.object = {0x1800, 2}, .expected = number(255, 1), .abort = AbortCode::timeout}));
}

TEST_F(PdoCheckTest, ARefusedRemedyEndsItWithItsObject) {
  PdoCheck check(pdos_, {});
  check.take(AbortCode::none, number(0x186));
  ASSERT_TRUE(check.step().write);
  check.take(AbortCode::none, {});
  check.take(AbortCode::read_only, {});
  EXPECT_TRUE(check.done());
  EXPECT_EQ(
      check.fault(),
      (Difference{.object = {0x1A00, 0}, .expected = number(0, 1), .abort = AbortCode::read_only}));
}

TEST_F(PdoCheckTest, WhatTheRemedyDoesNotWriteIsAFault) {
  has_[{0x1A00, 1}] = number(0x6000'0208);
  std::vector<AssumedPdo> fixed = pdos_;
  fixed[0].remedy.clear();
  PdoCheck check(fixed, {});
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1A00:0 ?1A00:1 ");
  EXPECT_EQ(check.fault(), (Difference{.object = {0x1A00, 1},
                                       .expected = number(0x6000'0108),
                                       .found = number(0x6000'0208)}));
}

TEST_F(PdoCheckTest, WhatWasJustWrittenIsNotRead) {
  const std::vector<ObjectWrite> written{
      {{0x1A00, 0}, number(0, 1)}, {{0x1A00, 1}, number(0x6000'0108)}, {{0x1A00, 0}, number(1, 1)}};
  PdoCheck check(pdos_, written);
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ");
  EXPECT_FALSE(check.fault());
}

// 1F22h may be written while the line runs; the image does not follow.
TEST_F(PdoCheckTest, AnotherPdoInTheConfigurationIsAFault) {
  const std::vector<ObjectWrite> written{{{0x1A00, 1}, number(0x6000'0208)}};
  PdoCheck check(pdos_, written);
  EXPECT_EQ(run(check), "?1800:1 ?1800:2 ?1A00:0 ");
  EXPECT_EQ(check.fault(), (Difference{.object = {0x1A00, 1},
                                       .expected = number(0x6000'0108),
                                       .found = number(0x6000'0208)}));
}

TEST(TypeOfATpdo, EndsItsTransmission) {
  struct Row {
    std::uint8_t before;
    std::uint8_t after;
    bool has_sync;
    bool ends;
  };
  const std::vector<Row> rows{
      {255, 253, true, true},    // on request alone
      {1, 252, true, true},      //
      {253, 252, false, false},  // as before
      {253, 255, false, false},  // sent by itself, too
      {255, 1, false, true},     // nothing makes the device send it
      {255, 0, false, true},     //
      {255, 1, true, false},     // sent with each SYNC
      {1, 10, false, false},     // the image had a synchronous one without SYNC
      {1, 255, false, false},    //
      {255, 245, false, false},  // reserved: the device refuses it
  };
  for (const Row& row : rows) {
    const std::vector<AssumedPdo> pdos{
        {.parameters = {}, .remedy = {}, .sent = {{.record = 0x1801, .type = row.before}}}};
    const auto ends = [&](od::Address address, const std::vector<std::byte>& value) {
      return ends_transmission(pdos, address, value, row.has_sync);
    };
    EXPECT_EQ(ends({0x1801, 2}, number(row.after, 1)), row.ends) << +row.before << +row.after;
    EXPECT_FALSE(ends({0x1801, 3}, number(253, 1)));
    EXPECT_FALSE(ends({0x1800, 2}, number(253, 1)));
    EXPECT_FALSE(ends({0x1801, 2}, number(253, 4))) << "the device refuses it";
    EXPECT_TRUE(ends({0x1801, 2}, {})) << "not known";
  }
}

TEST(PdoParameters, AreTheSameIfThePdoIsTheSame) {
  struct Row {
    od::Address address;
    std::uint32_t expected;
    std::uint32_t found;
    bool same;
  };
  const std::vector<Row> rows{
      {{0x1800, 1}, 0x185, 0x4000'0185, true},         // no RTR allowed
      {{0x1800, 1}, 0x185, 0x8000'0185, false},        // not valid
      {{0x1800, 1}, 0x185, 0x186, false},              //
      {{0x1800, 1}, 0x185, 0x2000'0185, false},        // another frame format
      {{0x1400, 1}, 0x8000'0000, 0x8000'0205, true},   // neither is valid
      {{0x1400, 2}, 255, 254, true},                   // both event-driven
      {{0x1400, 2}, 255, 1, false},                    //
      {{0x1400, 2}, 0, 1, false},                      //
      {{0x1600, 1}, 0x6200'0108, 0x6200'0208, false},  //
      {{0x1600, 0}, 255, 254, false},                  // MPDOs of two modes
  };
  for (const Row& row : rows) {
    EXPECT_EQ(is_same_parameter(row.address, number(row.expected), number(row.found)), row.same)
        << std::hex << row.address.index << ' ' << row.expected << ' ' << row.found;
  }
  EXPECT_TRUE(is_same_parameter({0x1600, 0}, number(2, 1), number(2, 4)));
  EXPECT_TRUE(is_same_parameter({0x1800, 2}, number(1, 1), number(1, 4)));
  std::vector<std::byte> longer = number(0x185);
  longer.push_back(std::byte{1});
  EXPECT_FALSE(is_same_parameter({0x1800, 1}, number(0x185), longer)) << "a COB-ID has 4 bytes";
  EXPECT_FALSE(is_same_parameter({0x1600, 0}, number(0, 1), {}));
  EXPECT_FALSE(is_same_parameter({0x1600, 0}, number(0, 1), std::vector<std::byte>(9)));
}

}  // namespace
}  // namespace linegate::manager
