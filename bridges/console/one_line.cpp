// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/one_line.h"

#include <string_view>

#include <nlohmann/json.hpp>

namespace linegate::console {
namespace {

constexpr char kDelete = '\x7F';
constexpr char kLead = '\xC2';  // UTF-8 of U+0080 to U+009F: this, and 80h to 9Fh

bool is_c1(std::string_view text, std::size_t at) {
  const auto second = at + 1 < text.size() ? static_cast<unsigned char>(text[at + 1]) : 0U;
  return text[at] == kLead && second >= 0x80 && second <= 0x9F;
}

void append_escape(std::string& out, char code) {
  constexpr std::string_view kHexDigits = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(code);
  out += "\\u00";
  out += kHexDigits[byte >> 4U];
  out += kHexDigits[byte & 0xFU];
}

// JSON has these characters inside strings only.
std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == kDelete) {
      append_escape(out, kDelete);
    } else if (is_c1(text, i)) {
      append_escape(out, text[++i]);
    } else {
      out += text[i];
    }
  }
  return out;
}

template <class Json>
std::string dump(const Json& json) {
  return escaped(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

std::string one_line(const nlohmann::json& json) {
  return dump(json);
}
std::string one_line(const nlohmann::ordered_json& json) {
  return dump(json);
}

}  // namespace linegate::console
