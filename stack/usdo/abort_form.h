// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace linegate::usdo {

// The abort frame that is sent. Public sources contradict each other: SOFA-CANopenFD has 7Fh and a
// code of one byte, another source 80h and the four bytes of CiA 301. Both are received.
enum class AbortForm : std::uint8_t { one_byte, four_bytes };

constexpr std::string_view name(AbortForm form) {
  return form == AbortForm::one_byte ? "one-byte" : "four-bytes";
}

}  // namespace linegate::usdo
