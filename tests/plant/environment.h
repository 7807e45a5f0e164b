// SPDX-License-Identifier: Apache-2.0
// Numbers that the environment may give to random tests.
#pragma once

#include <cstdlib>

namespace linegate::plant {

// Of that variable, or otherwise where it is not set.
inline unsigned long from_environment(const char* name, unsigned long otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoul(text, nullptr, 10);
}

}  // namespace linegate::plant
