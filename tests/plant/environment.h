// SPDX-License-Identifier: Apache-2.0
// Parameters of random tests from environment variables.
#pragma once

#include <cstdlib>

namespace linegate::plant {

// The value of the variable, or `otherwise` if it is not set.
inline unsigned long from_environment(const char* name, unsigned long otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoul(text, nullptr, 10);
}

#ifdef __has_feature  // Clang, with whose sanitizers this project is built
constexpr bool kIsSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kIsSanitized = false;
#endif

struct Seeds {
  unsigned long first;
  unsigned long count;
};

// The seeds of a random test: those of LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT, otherwise
// `count` from `first` on. With a sanitizer, which makes code eight times as slow, others and a
// quarter of the number.
inline Seeds seeds_of_run(unsigned long first, unsigned long count) {
  return {from_environment("LINEGATE_PLANT_SEED", kIsSanitized ? first + count : first),
          from_environment("LINEGATE_PLANT_COUNT", kIsSanitized ? count / 4 : count)};
}

}  // namespace linegate::plant
