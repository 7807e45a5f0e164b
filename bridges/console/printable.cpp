// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>

#include "bridges/console/table.h"

namespace linegate::console {
namespace {

struct Decoded {
  char32_t character = U'?';
  std::size_t bytes = 1;
};

bool continues(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80;
}

// Decodes one UTF-8 character; U'?' for an invalid byte.
Decoded decode_utf8(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  if (first < 0x80) {
    return {first, 1};
  }
  const std::size_t bytes = first >= 0xC2 && first < 0xE0   ? 2
                            : first >= 0xE0 && first < 0xF0 ? 3
                                                            : 0;
  if (bytes == 0 || text.size() < bytes ||
      !std::all_of(text.begin() + 1, text.begin() + static_cast<std::ptrdiff_t>(bytes),
                   continues)) {
    return {};
  }
  char32_t out = first & (bytes == 2 ? 0x1FU : 0x0FU);
  for (std::size_t i = 1; i < bytes; ++i) {
    out = out << 6U | (static_cast<unsigned char>(text[i]) & 0x3FU);
  }
  return {out, bytes};
}

// Characters that always occupy one column: Latin, Greek, Cyrillic and neighbouring scripts, and
// signs for units. Excludes combining and right-to-left characters.
bool one_column(char32_t c) {
  struct Range {
    char32_t first, last;
  };
  constexpr std::array<Range, 7> kRanges{{{0x20, 0x7E},
                                          {0xA1, 0xAC},
                                          {0xAE, 0x2FF},
                                          {0x370, 0x482},
                                          {0x48A, 0x52F},
                                          {0x2013, 0x2026},
                                          {0x2070, 0x22FF}}};
  return std::any_of(kRanges.begin(), kRanges.end(),
                     [c](const Range& range) { return c >= range.first && c <= range.last; });
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Decoded next = decode_utf8(text);
    if (one_column(next.character)) {
      out += next.character == U'?' ? std::string_view("?") : text.substr(0, next.bytes);
    } else {
      out += '?';
    }
    text.remove_prefix(next.bytes);
  }
  return out;
}

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char byte) { return !continues(byte); }));
}

std::string_view cut(std::string_view text, std::size_t from, std::size_t count) {
  const auto place = [text](std::size_t begin, std::size_t characters) {
    std::size_t at = begin;
    while (at < text.size() && characters > 0) {
      ++at;
      while (at < text.size() && continues(text[at])) {
        ++at;
      }
      --characters;
    }
    return at;
  };
  const std::size_t begin = place(0, from);
  return text.substr(begin, place(begin, count) - begin);
}

std::string shorten(std::string_view text, std::size_t width) {
  const std::size_t all = width_of(text);
  if (all <= width) {
    return std::string(text);
  }
  if (width == 0) {
    return {};
  }
  const std::size_t end = (width - 1) / 2;
  std::string out(cut(text, 0, width - 1 - end));
  out += '~';
  return out += cut(text, all - end, end);
}

}  // namespace linegate::console
