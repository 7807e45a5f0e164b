// SPDX-License-Identifier: Apache-2.0
// Part of each test program: a violated assertion is printed before the program aborts, with the
// running test case and its notes.
#include <cstdio>

#include <gtest/gtest.h>

#include "stack/base/assert.h"

#include "tests/assertion_note.h"

namespace linegate {
namespace {

void print_violated(const Assertion& assertion) {
  std::fprintf(stderr, "%s:%d: assertion violated: %s (%s)\n", assertion.file, assertion.line,
               assertion.text, assertion.expression);
  if (const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info()) {
    std::fprintf(stderr, "in %s.%s\n", test->test_suite_name(), test->name());
  }
  for (const AssertionNote* note = AssertionNote::newest(); note != nullptr;
       note = note->before()) {
    std::fprintf(stderr, "in %s\n", note->text().c_str());
  }
}

[[maybe_unused]] const AssertionHandler kNoHandler = set_assertion_handler(print_violated);

}  // namespace
}  // namespace linegate
