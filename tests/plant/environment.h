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

}  // namespace linegate::plant
