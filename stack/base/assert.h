// SPDX-License-Identifier: Apache-2.0
// Preconditions and invariants: conditions that only a fault in our own code can violate, whatever
// the network or a file contains. A condition that input can violate is an error, which is checked
// and reported, never an assertion.
//
// LINEGATE_ASSERT is active in every build. LINEGATE_ASSERT_HOT is for code that runs with each PDO
// or SDO frame, where the check shows in the benchmarks: it is active in every build without
// NDEBUG, which includes all builds with sanitizers and fuzzers; with NDEBUG the condition is
// compiled and not evaluated.
#pragma once

namespace linegate {

// A condition that did not hold, and its place in the source.
struct Assertion {
  const char* expression = "";  // the source text of the condition
  const char* text = "";        // the requirement in words
  const char* file = "";        // file name as the compiler gives it
  int line = 0;
};

// Called with a violated assertion, on the thread that violated it. The process aborts when the
// handler returns.
using AssertionHandler = void (*)(const Assertion& assertion);

// Replaces the handler of the process and returns the previous one; nullptr (the initial value): no
// handler. Must not be called while another thread runs code of this project.
AssertionHandler set_assertion_handler(AssertionHandler handler) noexcept;

// Calls the handler, if there is one, and then std::abort(). A violation within the handler aborts
// at once.
[[noreturn, gnu::cold]] void assertion_failed(const char* expression, const char* text,
                                              const char* file, int line);

}  // namespace linegate

// text: a string literal that states the requirement. LINEGATE_ASSERT evaluates the condition once,
// in every build: the condition may be a call that cannot fail here. The condition of
// LINEGATE_ASSERT_HOT must not have side effects.
#define LINEGATE_ASSERT(condition, text) \
  ((condition) ? static_cast<void>(0)    \
               : ::linegate::assertion_failed(#condition, text, __FILE__, __LINE__))

#ifdef NDEBUG
#define LINEGATE_ASSERT_HOT(condition, text) static_cast<void>(false && (condition))
#else
#define LINEGATE_ASSERT_HOT(condition, text) LINEGATE_ASSERT(condition, text)
#endif
