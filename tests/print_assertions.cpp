// SPDX-License-Identifier: Apache-2.0
// Part of each test program: a violated assertion is printed before the program aborts.
#include <cstdio>

#include "stack/base/assert.h"

namespace linegate {
namespace {

void print_violated(const Assertion& assertion) {
  std::fprintf(stderr, "%s:%d: assertion violated: %s (%s)\n", assertion.file, assertion.line,
               assertion.text, assertion.expression);
}

[[maybe_unused]] const AssertionHandler kNoHandler = set_assertion_handler(print_violated);

}  // namespace
}  // namespace linegate
