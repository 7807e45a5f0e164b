// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configuration_run.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

#include "tests/stack/manager/numbers.h"

namespace linegate::manager {
namespace {

using Outcome = ConfigurationRun::Result;

ConfigurationOrder order() {
  return {.node = 5, .writes = {{{0x2000, 1}, number(7, 1)}, {{0x1017, 0}, number(100, 2)}}};
}

std::string text(const TaskStep& step) {
  char out[48];
  std::snprintf(out, sizeof out, "%s%04X:%u=%llX ", step.write ? "" : "?",
                unsigned{step.address.index}, unsigned{step.address.sub},
                static_cast<unsigned long long>(load_le(std::span<const std::byte>(step.data))));
  return out;
}

// Every download succeeds, and 1020h returns the date and time in `has`.
std::string run(ConfigurationRun& run, ConfigurationDate has = {}) {
  std::string out;
  while (const auto step = run.wanted()) {
    out += text(*step);
    const bool date = step->address == od::Address{0x1020, 1};
    run.take(AbortCode::none,
             step->write ? std::vector<std::byte>{} : number(date ? has.date : has.time));
  }
  return out;
}

TEST(ConfigurationRun, WritesTheConciseDcfInItsOrder) {
  ConfigurationRun plain(order());
  EXPECT_EQ(run(plain), "2000:1=7 1017:0=64 ");
  EXPECT_EQ(plain.result(), Outcome::applied);
  EXPECT_EQ(plain.abort(), AbortCode::none);
  ConfigurationRun nothing({.node = 5});
  EXPECT_EQ(run(nothing), "");
  EXPECT_EQ(nothing.result(), Outcome::applied);
}

TEST(ConfigurationRun, ANodeThatHasItsConfigurationIsSentNothing) {
  auto dated = order();
  dated.expected = {.date = 15'000, .time = 1'000};
  dated.restore = 1;
  dated.store = 1;
  ConfigurationRun same(dated);
  EXPECT_EQ(run(same, dated.expected), "?1020:1=0 ?1020:2=0 ");
  EXPECT_EQ(same.result(), Outcome::unchanged);
}

TEST(ConfigurationRun, AnotherDateOrTimeOrNoneIsConfiguredAndDated) {
  auto dated = order();
  dated.expected = {.date = 15'000, .time = 1'000};
  ConfigurationRun other_date(dated);
  EXPECT_EQ(run(other_date, {.date = 14'999, .time = 1'000}),
            "?1020:1=0 2000:1=7 1017:0=64 1020:1=3A98 1020:2=3E8 ");
  ConfigurationRun other_time(dated);
  EXPECT_EQ(run(other_time, {.date = 15'000, .time = 1'001}),
            "?1020:1=0 ?1020:2=0 2000:1=7 1017:0=64 1020:1=3A98 1020:2=3E8 ");
  ConfigurationRun none(dated);
  ASSERT_EQ(text(*none.wanted()), "?1020:1=0 ");
  none.take(AbortCode::no_object, {});
  EXPECT_EQ(run(none), "2000:1=7 1017:0=64 1020:1=3A98 1020:2=3E8 ");
  dated.check = false;
  ConfigurationRun forced(dated);
  EXPECT_EQ(run(forced, dated.expected), "2000:1=7 1017:0=64 1020:1=3A98 1020:2=3E8 ");
}

// pdo_check_test.cpp has the rules.
TEST(ConfigurationRun, ThePdosOfTheImageAreReadBeforeErrorControlAndStoring) {
  auto dated = order();
  dated.expected = {.date = 1, .time = 2};
  dated.pdos = {{.parameters = {{{0x1800, 1}, number(0)}}, .remedy = {{{0x1800, 1}, number(0)}}}};
  ConfigurationRun same(dated);
  EXPECT_EQ(run(same), "?1020:1=0 2000:1=7 ?1800:1=0 1017:0=64 1020:1=1 1020:2=2 ");
  EXPECT_EQ(same.result(), Outcome::applied);
  ConfigurationRun known(dated);
  EXPECT_EQ(run(known, dated.expected), "?1020:1=0 ?1020:2=0 ")
      << "the device clears 1020h with every write";
  dated.pdos[0].parameters[0].data = number(0x185);
  ConfigurationRun without_effect(dated);
  EXPECT_EQ(run(without_effect),
            "?1020:1=0 2000:1=7 ?1800:1=0 1800:1=0 ?1800:1=0 1800:1=0 ?1800:1=0 ")
      << "twice";
  EXPECT_EQ(without_effect.result(), Outcome::failed);
}

TEST(ConfigurationRun, APdoThatDiffersAndIsNotWrittenFailsIt) {
  ConfigurationRun differs(
      {.node = 5, .pdos = {{.parameters = {{{0x1800, 1}, number(0x185)}}, .remedy = {}}}});
  EXPECT_EQ(run(differs), "?1800:1=0 ");
  EXPECT_EQ(differs.result(), Outcome::failed);
  EXPECT_EQ(differs.abort(), AbortCode::none);
  EXPECT_EQ(differs.object(), (od::Address{0x1800, 1}));
  EXPECT_EQ(differs.fault(),
            (Difference{.object = {0x1800, 1}, .expected = number(0x185), .found = number(0)}));
}

TEST(ConfigurationRun, AFoundValueThatIsNo32BitNumberIsOneOfTheWrongLength) {
  const auto found = [](std::vector<std::byte> value) {
    ConfigurationRun differs(
        {.node = 5, .pdos = {{.parameters = {{{0x1A00, 1}, number(0x6200'0108)}}, .remedy = {}}}});
    (void)differs.wanted();
    differs.take(AbortCode::none, value);
    EXPECT_FALSE(differs.wanted());
    EXPECT_EQ(differs.fault().found, value);
    return describe_boot('J', differs.finding());
  };
  EXPECT_EQ(found(number(0x12'0186, 3)),
            "configuration failed: 1A00:01 is 00120186h, not 62000108h");
  EXPECT_EQ(found({std::byte{7}, {}, {}, {}, {}}),
            "configuration failed: 1A00:01 is 00000007h, not 62000108h");
  const std::string too_long =
      "PDO could not be compared with the image, or configured: 1A00:01 ended with 06070012h, " +
      std::string(describe(AbortCode::length_too_high));
  EXPECT_EQ(found({std::byte{8}, std::byte{1}, {}, std::byte{0x62}, std::byte{1}}), too_long);
  EXPECT_EQ(found(std::vector<std::byte>(9, std::byte{'a'})), too_long) << "a string";
  EXPECT_EQ(
      found({}),
      "PDO could not be compared with the image, or configured: 1A00:01 ended with 06070013h, " +
          std::string(describe(AbortCode::length_too_low)));
}

TEST(ConfigurationRun, OfANodeThatIsKeptAliveThePdosAreReadAlone) {
  auto kept = order();
  kept.expected = {.date = 1, .time = 2};
  kept.restore = 1;
  kept.store = 1;
  kept.read_only = true;
  kept.pdos = {{.parameters = {{{0x1800, 1}, number(0)}}, .remedy = {{{0x1800, 1}, number(0)}}}};
  ConfigurationRun same(kept);
  EXPECT_EQ(run(same), "?1800:1=0 ");
  EXPECT_EQ(same.result(), Outcome::applied);
  kept.pdos[0].parameters[0].data = number(0x185);
  ConfigurationRun other(kept);
  EXPECT_EQ(run(other), "?1800:1=0 ");
  EXPECT_EQ(other.result(), Outcome::unlike);
  kept.pdos[0].parameters = {{{0x1400, 2}, number(1, 1)}};
  ConfigurationRun other_type(kept);
  EXPECT_EQ(run(other_type), "") << "no reason for a reset";
  EXPECT_EQ(other_type.result(), Outcome::applied);
  kept.pdos[0].parameters = {{{0x1800, 1}, number(0)}};
  ConfigurationRun silent(kept);
  (void)silent.wanted();
  silent.take(AbortCode::timeout, {});
  ASSERT_TRUE(silent.wanted()) << "the answer may have been lost";
  silent.take(AbortCode::timeout, {});
  EXPECT_FALSE(silent.wanted());
  EXPECT_EQ(silent.result(), Outcome::failed);
}

TEST(ConfigurationRun, RestoringComesBeforeEverythingAndWantsAReset) {  // 1F8Ah
  auto restoring = order();
  restoring.restore = 4;
  ConfigurationRun restored(restoring);
  const auto step = restored.wanted();
  EXPECT_EQ(text(*step), "1011:4=64616F6C ") << "load";
  EXPECT_EQ(step->timeout, kLoadTimeout);
  restored.take(AbortCode::none, {});
  EXPECT_FALSE(restored.wanted());
  EXPECT_EQ(restored.result(), Outcome::restored);
  ConfigurationRun refused(restoring);
  (void)refused.wanted();
  refused.take(AbortCode::no_sub_index, {});
  EXPECT_FALSE(refused.wanted());
  EXPECT_EQ(refused.result(), Outcome::failed);
  EXPECT_EQ(refused.object(), (od::Address{0x1011, 4}));
}

TEST(ConfigurationRun, StoringComesLastAndOnlyWithADate) {
  auto storing = order();
  storing.store = 1;
  ConfigurationRun undated(storing);
  EXPECT_EQ(run(undated), "2000:1=7 1017:0=64 ");
  storing.expected = {.date = 1, .time = 2};
  ConfigurationRun dated(storing);
  EXPECT_EQ(run(dated), "?1020:1=0 2000:1=7 1017:0=64 1020:1=1 1020:2=2 1010:1=65766173 ");
  storing.writes.push_back({{0x1020, 1}, number(1)});
  storing.writes.push_back({{0x1020, 2}, number(2)});
  ConfigurationRun said(storing);
  EXPECT_EQ(run(said), "?1020:1=0 2000:1=7 1017:0=64 1020:1=1 1020:2=2 1010:1=65766173 ")
      << "the concise DCF writes the date itself";
}

TEST(ConfigurationRun, ADeviceThatTakesNoDateStoresNothing) {
  auto storing = order();
  storing.store = 1;
  storing.expected = {.date = 1, .time = 2};
  storing.check = false;
  ConfigurationRun run(storing);
  for (const AbortCode answer : {AbortCode::none, AbortCode::none, AbortCode::no_object}) {
    ASSERT_TRUE(run.wanted());
    run.take(answer, {});
  }
  EXPECT_FALSE(run.wanted());
  EXPECT_EQ(run.result(), Outcome::applied) << "configured at every boot";
  EXPECT_EQ(run.abort(), AbortCode::no_object);
  EXPECT_EQ(run.object(), (od::Address{0x1020, 1}));
}

TEST(ConfigurationRun, TheFirstRefusalEndsItWithItsObjectAndValue) {
  ConfigurationRun run(order());
  (void)run.wanted();
  run.take(AbortCode::none, {});
  EXPECT_EQ(run.done(), 1U);
  (void)run.wanted();
  run.take(AbortCode::value_too_high, {});
  EXPECT_FALSE(run.wanted());
  EXPECT_EQ(run.result(), Outcome::failed);
  EXPECT_EQ(run.fault(), (Difference{.object = {0x1017, 0},
                                     .expected = number(100, 2),
                                     .abort = AbortCode::value_too_high}));
}

TEST(ConfigurationRun, CommandsOfTheConciseDcfHaveTimeForTheFlash) {
  ConfigurationRun run({.node = 5, .writes = {{{0x1010, 1}, number(0x6576'6173)}}});
  EXPECT_EQ(run.wanted()->timeout, kSaveTimeout);
}

TEST(ConfigurationDate, IsWhatTheWritesSayOrAFingerprintOfThem) {
  std::vector<ObjectWrite> writes = order().writes;
  EXPECT_FALSE(date_of(writes).known());
  const ConfigurationDate print = fingerprint_of(writes);
  EXPECT_TRUE(print.known());
  EXPECT_EQ(print, fingerprint_of(writes));
  writes[1].data[0] = std::byte{101};
  EXPECT_NE(print, fingerprint_of(writes));
  writes.insert(writes.begin(), {{{0x1020, 1}, number(3)}, {{0x1020, 2}, number(4)}});
  EXPECT_EQ(date_of(writes), (ConfigurationDate{.date = 3, .time = 4}));
  writes.insert(writes.begin(), {{0x1010, 1}, number(5)});
  date_last(writes);
  EXPECT_EQ(writes.front().address, (od::Address{0x2000, 1}));
  EXPECT_EQ(writes[3].address, (od::Address{0x1020, 2}));
  EXPECT_EQ(writes.back().address, (od::Address{0x1010, 1}));
}

}  // namespace
}  // namespace linegate::manager
