// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/text.h"

#include <algorithm>

#include "stack/base/utf8.h"

namespace linegate::eds {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

char lower_case(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

// Returns the character of text at `at` and advances `at`; never U+FFFD for valid UTF-8. For a byte
// that does not begin a valid sequence, sets ok to false and returns the byte (Latin-1).
char32_t next_character(std::string_view text, std::size_t& at, bool& ok) {
  std::string_view rest = text.substr(at);
  if (const auto code = take_code_point(rest)) {
    at = text.size() - rest.size();
    return *code;
  }
  ok = false;
  return static_cast<unsigned char>(text[at++]);
}

void append_utf16(std::vector<std::byte>& out, char32_t unit) {
  out.push_back(static_cast<std::byte>(unit));
  out.push_back(static_cast<std::byte>(unit >> 8U));
}

}  // namespace

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) {
    text.remove_prefix(1);
  }
  while (!text.empty() && is_blank(text.back())) {
    text.remove_suffix(1);
  }
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), lower_case);
  return out;
}

std::string comparable(std::string_view text) {
  std::string out = lower(text);
  std::erase_if(out, is_blank);
  return out;
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower_case(x) == lower_case(y); });
}

std::string_view without_comment(std::string_view text) {
  return trim(text.substr(0, text.find(';')));
}

std::string quote(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string out = "'";
  for (const char c : text.substr(0, kLongest)) {
    out += c >= ' ' && c <= '~' ? c : '?';
  }
  return out + (text.size() > kLongest ? "...'" : "'");
}

std::string hex(std::uint64_t value, unsigned digits) {
  std::string out;
  while (value != 0 || out.size() < digits) {
    out += "0123456789ABCDEF"[value & 0xFU];
    value >>= 4U;
  }
  std::reverse(out.begin(), out.end());
  return out + 'h';
}

std::size_t first_not_utf8(std::string_view text) {
  bool ok = true;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    (void)next_character(text, at, ok);
    if (!ok) {
      return begin;
    }
  }
  return text.size();
}

bool is_utf8(std::string_view text) {
  return first_not_utf8(text) == text.size();
}

std::string to_utf8(std::string_view text) {
  if (is_utf8(text)) {
    return std::string(text);
  }
  std::string out;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x80) {
      out += c;
    } else {
      append_utf8(code, out);
    }
  }
  return out;
}

std::vector<std::byte> to_utf16(std::string_view text) {
  const std::string utf8 = to_utf8(text);
  std::vector<std::byte> out;
  bool ok = true;
  for (std::size_t at = 0; at < utf8.size();) {
    char32_t character = next_character(utf8, at, ok);
    if (character > 0xFFFF) {
      character -= 0x1'0000;
      append_utf16(out, 0xD800 + (character >> 10U));
      character = 0xDC00 + (character & 0x3FFU);
    }
    append_utf16(out, character);
  }
  return out;
}

std::string from_utf16(std::span<const std::byte> text) {
  const auto unit = [text](std::size_t at) -> char32_t {
    return at + 1 < text.size()
               ? std::to_integer<unsigned>(text[at]) | std::to_integer<unsigned>(text[at + 1]) << 8U
               : 0U;
  };
  const auto is_half = [](char32_t c, char32_t first) { return c >= first && c < first + 0x400; };
  std::string out;
  for (std::size_t at = 0; at + 1 < text.size(); at += 2) {
    const char32_t high = unit(at);
    const char32_t low = unit(at + 2);
    if (is_half(high, 0xD800) && is_half(low, 0xDC00)) {
      append_utf8(0x1'0000 + ((high - 0xD800) << 10U) + (low - 0xDC00), out);
      at += 2;
    } else {
      append_utf8(is_half(high, 0xD800) || is_half(high, 0xDC00) ? U'?' : high, out);
    }
  }
  return out;
}

}  // namespace linegate::eds
