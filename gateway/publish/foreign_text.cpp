// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/foreign_text.h"

#include <algorithm>

namespace linegate::gateway {

std::string printable(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '.');
  return out;
}

}  // namespace linegate::gateway
