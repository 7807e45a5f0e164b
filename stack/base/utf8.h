// SPDX-License-Identifier: Apache-2.0
// UTF-8 (RFC 3629), code point by code point.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace linegate {

// code: at most 10FFFFh, no surrogate.
void append_utf8(std::uint32_t code, std::string& to);

// Removes the first code point of the text, which is not empty. Nothing if the text does not begin
// with one in its shortest form, or with a surrogate; the text is then unchanged.
std::optional<std::uint32_t> take_code_point(std::string_view& text);

}  // namespace linegate
