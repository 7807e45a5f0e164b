// SPDX-License-Identifier: Apache-2.0
#include "stack/scan/survey.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "stack/scan/conflicts.h"
#include "stack/scan/scanned_node.h"

#include "tests/stack/scan/answers.h"

namespace linegate::scan {
namespace {

using test::Answers;

bool was_asked(const Answers& answers, od::Address address) {
  return std::ranges::count(answers.asked, address) == 1;
}

TEST(Survey, AsksForEachOfThe1024PdoRecordsOnce) {
  Answers answers;
  answers.set(0x1000, 0, 0x0002'0192, 4);
  const ScannedNode node = answers.survey();
  EXPECT_EQ(node.end, AbortCode::none);
  for (std::uint16_t i = 0; i < 512; ++i) {
    EXPECT_TRUE(was_asked(answers, {static_cast<std::uint16_t>(0x1400 + i), 0}));
    EXPECT_TRUE(was_asked(answers, {static_cast<std::uint16_t>(0x1800 + i), 0}));
  }
  EXPECT_EQ(node.values.size(), 1U);
}

TEST(Survey, ReadsRecordsBehindGapsWithTheirMapping) {
  Answers answers;
  answers.set_pdo(0x1406, 0x305, 255, {0x6040'0010});
  answers.set_pdo(0x19FF, 0x4000'0185, 1, {0x6041'0010, 0x6064'0020});
  const ScannedNode node = answers.survey();
  EXPECT_EQ(node.number({0x1406, 1}), 0x305U);
  EXPECT_EQ(node.number({0x1606, 1}), 0x6040'0010U);
  EXPECT_EQ(node.number({0x19FF, 2}), 1U);
  EXPECT_EQ(node.number({0x1BFF, 0}), 2U);
  EXPECT_EQ(node.number({0x1BFF, 2}), 0x6064'0020U);
  EXPECT_FALSE(was_asked(answers, {0x1BFF, 3}));
  EXPECT_TRUE(std::ranges::is_sorted(node.values, {}, &manager::ObjectWrite::address));
}

TEST(Survey, LeavesOutTheReservedSubIndexOfACommunicationRecord) {
  Answers answers;
  answers.set_pdo(0x1800, 0x185, 255, {});
  answers.set(0x1800, 0, 6, 1);
  (void)answers.survey();
  EXPECT_FALSE(was_asked(answers, {0x1800, 4}));
  EXPECT_TRUE(was_asked(answers, {0x1800, 5}));
  EXPECT_TRUE(was_asked(answers, {0x1800, 6}));
}

TEST(Survey, BelievesNoCountBeyondWhatCiAAllows) {
  Answers answers;
  answers.set(0x1018, 0, 200, 1);
  answers.set_pdo(0x1800, 0x185, 255, {});
  answers.set(0x1800, 0, 255, 1);
  answers.set(0x1A00, 0, 254, 1);  // a multiplexed PDO
  (void)answers.survey();
  EXPECT_TRUE(was_asked(answers, {0x1018, 4}));
  EXPECT_FALSE(was_asked(answers, {0x1018, 5}));
  EXPECT_FALSE(was_asked(answers, {0x1800, 7}));
  EXPECT_FALSE(was_asked(answers, {0x1A00, 1}));
}

TEST(Survey, AsksOnlyModulesOfCiA401ForTheInterruptEnable) {
  Answers drive;
  drive.set(0x1000, 0, 0x0002'0192, 4);
  (void)drive.survey();
  EXPECT_FALSE(was_asked(drive, {0x6423, 0}));
  Answers module;
  module.set(0x1000, 0, 0x0004'0191, 4);
  module.set(0x6423, 0, 0, 1);
  EXPECT_EQ(module.survey().number({0x6423, 0}), 0U);
}

TEST(Survey, ANodeThatDoesNotAnswerIsNotThere) {
  Survey survey(5);
  survey.take(AbortCode::timeout, {});
  EXPECT_FALSE(survey.wanted());
  EXPECT_FALSE(survey.present());
}

TEST(Survey, ANodeThatRefusesItsDeviceTypeIsThere) {
  Survey survey(5);
  survey.take(AbortCode::no_object, {});
  EXPECT_TRUE(survey.wanted());
  EXPECT_TRUE(survey.present());
}

TEST(Survey, KeepsWhatWasReadWhenTheNodeFallsSilent) {
  Survey survey(5);
  survey.take(AbortCode::none, {std::byte{0x92}, std::byte{1}, std::byte{0}, std::byte{0}});
  survey.take(AbortCode::timeout, {});
  EXPECT_FALSE(survey.wanted());
  EXPECT_TRUE(survey.present());
  EXPECT_EQ(survey.result().end, AbortCode::timeout);
  EXPECT_EQ(survey.result().number({0x1000, 0}), 0x192U);
}

TEST(ScanConflicts, NameBothWhoSendOnOneIdentifier) {
  Answers first;
  first.set(0x1014, 0, 0x85, 4);
  first.set_pdo(0x1800, 0x4000'0185, 255, {});  // no RTR: the same identifier all the same
  Answers second;
  second.set(0x1014, 0, 0x86, 4);
  second.set_pdo(0x1802, 0x185, 255, {});
  second.set_pdo(0x1803, 0x8000'0185, 255, {});  // does not exist
  second.set_pdo(0x1804, 0x2000'0185, 255, {});  // 29 bit
  const std::vector<ScannedNode> nodes{first.survey(5), second.survey(6)};
  const auto found = conflicts(nodes);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].cob_id.id(), 0x185U);
  EXPECT_EQ(found[0].first.node, 5);
  EXPECT_EQ(found[0].second.node, 6);
  EXPECT_EQ(found[0].second.object, (od::Address{0x1802, 1}));
}

TEST(ScanConflicts, SyncIsProducedByOneOnly) {
  Answers consumer;
  consumer.set(0x1005, 0, 0x80, 4);
  Answers producer;
  producer.set(0x1005, 0, 0x4000'0080, 4);
  const std::vector<ScannedNode> good{consumer.survey(1), consumer.survey(2), producer.survey(3)};
  EXPECT_TRUE(conflicts(good).empty());
  const std::vector<ScannedNode> bad{producer.survey(3), producer.survey(4)};
  EXPECT_EQ(conflicts(bad).size(), 1U);
}

}  // namespace
}  // namespace linegate::scan
