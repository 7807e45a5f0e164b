// SPDX-License-Identifier: Apache-2.0
#include "stack/base/assert.h"

#include <cstdlib>
#include <utility>

namespace linegate {
namespace {

AssertionHandler current_handler = nullptr;

}  // namespace

AssertionHandler set_assertion_handler(AssertionHandler handler) noexcept {
  return std::exchange(current_handler, handler);
}

void assertion_failed(const char* expression, const char* text, const char* file, int line) {
  thread_local bool failing = false;
  if (!std::exchange(failing, true) && current_handler != nullptr) {
    current_handler({.expression = expression, .text = text, .file = file, .line = line});
  }
  std::abort();
}

}  // namespace linegate
