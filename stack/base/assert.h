// SPDX-License-Identifier: Apache-2.0
// Preconditions and invariants: what our own code must keep, whatever the network or a file
// contains. What others can violate is an error that is checked and reported, never an assertion.
//
// LINEGATE_ASSERT is on in every build. LINEGATE_ASSERT_HOT is for what runs with each PDO or SDO
// frame, where the benchmarks show the check: on in every build without NDEBUG, among them all
// builds with sanitizers and fuzzers; with NDEBUG the condition is compiled and not evaluated.
#pragma once

namespace linegate {

// A condition that did not hold, and where it stands.
struct Assertion {
  const char* expression = "";  // the condition as it is written
  const char* text = "";        // what must hold
  const char* file = "";        // as the compiler names it
  int line = 0;
};

// Gets a violated assertion, on the thread that violated it. The process aborts when it returns.
using AssertionHandler = void (*)(const Assertion& assertion);

// Replaces the handler of the process and returns the one before; nullptr (as in the beginning): no
// handler. Not to be called while another thread runs code of this project.
AssertionHandler set_assertion_handler(AssertionHandler handler) noexcept;

// Calls the handler, if there is one, and std::abort(). A violation within the handler aborts at
// once.
[[noreturn, gnu::cold]] void assertion_failed(const char* expression, const char* text,
                                              const char* file, int line);

}  // namespace linegate

// text is a string literal that says what must hold. LINEGATE_ASSERT evaluates condition once, in
// every build: it may be a call that cannot fail here. That of LINEGATE_ASSERT_HOT has no side
// effects.
#define LINEGATE_ASSERT(condition, text) \
  ((condition) ? static_cast<void>(0)    \
               : ::linegate::assertion_failed(#condition, text, __FILE__, __LINE__))

#ifdef NDEBUG
#define LINEGATE_ASSERT_HOT(condition, text) static_cast<void>(false && (condition))
#else
#define LINEGATE_ASSERT_HOT(condition, text) LINEGATE_ASSERT(condition, text)
#endif
