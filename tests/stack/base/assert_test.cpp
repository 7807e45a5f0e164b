// SPDX-License-Identifier: Apache-2.0
#include "stack/base/assert.h"

#include <csignal>
#include <cstdio>

#include <gtest/gtest.h>

#include "tests/assertion_note.h"

namespace linegate {
namespace {

void print_assertion(const Assertion& assertion) {
  std::fprintf(stderr, "%s|%s|%s|%d\n", assertion.expression, assertion.text, assertion.file,
               assertion.line);
}

void violate_again(const Assertion& assertion) {
  print_assertion(assertion);
  LINEGATE_ASSERT(assertion.line < 0, "the handler violates one itself");
}

constexpr int half(int number) {
  LINEGATE_ASSERT(number % 2 == 0, "the number is even");
  return number / 2;
}

// Restores the assertion handler of this process afterwards.
class AssertDeathTest : public testing::Test {
 protected:
  AssertDeathTest() : before_(set_assertion_handler(print_assertion)) {}
  ~AssertDeathTest() override { set_assertion_handler(before_); }
  AssertDeathTest(const AssertDeathTest&) = delete;
  AssertDeathTest& operator=(const AssertDeathTest&) = delete;

 private:
  AssertionHandler before_;
};

TEST_F(AssertDeathTest, TheHandlerGetsExpressionTextFileAndLine) {
  EXPECT_DEATH(half(3), "number % 2 == 0\\|the number is even\\|.*assert_test.cpp\\|[1-9][0-9]*");
}

TEST_F(AssertDeathTest, AbortsWithoutAHandler) {
  set_assertion_handler(nullptr);
  EXPECT_EXIT(half(3), testing::KilledBySignal(SIGABRT), "^$");
}

TEST_F(AssertDeathTest, AViolationInTheHandlerAbortsAtOnce) {
  set_assertion_handler(violate_again);
  EXPECT_EXIT(half(3), testing::KilledBySignal(SIGABRT), "the number is even");
}

TEST_F(AssertDeathTest, TheHandlerBeforeIsReturned) {
  EXPECT_EQ(set_assertion_handler(violate_again), print_assertion);
  EXPECT_EQ(set_assertion_handler(print_assertion), violate_again);
}

// What every test program prints: the running case and its notes.
TEST(AssertNoteDeathTest, TheCaseAndItsNotesArePrinted) {
  const AssertionNote outer("plant 7");
  const AssertionNote inner("seed 12");
  EXPECT_DEATH(half(3),
               "assert_test.cpp:[0-9]+: assertion violated: the number is even.*\n"
               "in AssertNoteDeathTest.TheCaseAndItsNotesArePrinted\n"
               "in seed 12\n"
               "in plant 7\n");
}

TEST(AssertNoteDeathTest, ANoteIsOverWhereItEnds) {
  { const AssertionNote note("plant 7"); }
  EXPECT_EQ(AssertionNote::newest(), nullptr);
}

TEST(Assert, AConditionThatHoldsHasNoEffect) {
  static_assert(half(4) == 2, "usable in constant expressions");
  EXPECT_EQ(half(half(12)), 3);
}

TEST(Assert, TheOneOfTheHotPathEvaluatesNothingWithNdebug) {
  int evaluated = 0;
  LINEGATE_ASSERT_HOT(++evaluated == 1, "counted");
#ifdef NDEBUG
  EXPECT_EQ(evaluated, 0);
#else
  EXPECT_EQ(evaluated, 1);
#endif
}

}  // namespace
}  // namespace linegate
