// SPDX-License-Identifier: Apache-2.0
// Describes what a test does (a seed, a scenario), to be printed if an assertion is violated.
#pragma once

#include <string>
#include <utility>

namespace linegate {

// Printed for violations on the thread that created it, while it exists. Notes can be nested.
class AssertionNote {
 public:
  explicit AssertionNote(std::string text)
      : text_(std::move(text)), before_(std::exchange(newest_, this)) {}
  ~AssertionNote() { newest_ = before_; }
  AssertionNote(const AssertionNote&) = delete;
  AssertionNote& operator=(const AssertionNote&) = delete;

  // The innermost note of this thread; nullptr if there is none.
  static const AssertionNote* newest() { return newest_; }
  const AssertionNote* before() const { return before_; }
  const std::string& text() const { return text_; }

 private:
  inline static thread_local const AssertionNote* newest_ = nullptr;

  std::string text_;
  const AssertionNote* before_;
};

}  // namespace linegate
