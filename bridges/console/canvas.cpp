// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/canvas.h"

#include <algorithm>

namespace linegate::console {
namespace {

// The text is printable(): one to three bytes a character.
char32_t first_character(std::string_view text) {
  const auto byte = [&](std::size_t at) {
    return static_cast<char32_t>(static_cast<unsigned char>(text[at]));
  };
  if (byte(0) < 0x80) {
    return byte(0);
  }
  if (byte(0) < 0xE0) {
    return (byte(0) & 0x1FU) << 6U | (byte(1) & 0x3FU);
  }
  return (byte(0) & 0x0FU) << 12U | (byte(1) & 0x3FU) << 6U | (byte(2) & 0x3FU);
}

void append_utf8(std::string& out, char32_t c) {
  const auto add = [&out](char32_t byte) { out += static_cast<char>(byte); };
  if (c < 0x80) {
    add(c);
  } else if (c < 0x800) {
    add(0xC0U | c >> 6U);
    add(0x80U | (c & 0x3FU));
  } else {
    add(0xE0U | c >> 12U);
    add(0x80U | (c >> 6U & 0x3FU));
    add(0x80U | (c & 0x3FU));
  }
}

}  // namespace

Canvas::Canvas(std::size_t rows, std::size_t columns)
    : rows_(rows), columns_(columns), cells_(rows * columns) {
}

void Canvas::put(std::size_t row, std::size_t column, std::string_view text, Style style) {
  if (row >= rows_) {
    return;
  }
  const std::string safe = printable(text);
  std::string_view rest = safe;
  for (; !rest.empty() && column < columns_; ++column) {
    cells_[row * columns_ + column] = {first_character(rest), style};
    rest.remove_prefix(cut(rest, 0, 1).size());
  }
}

void Canvas::fill(std::size_t row, std::string_view text, Style style) {
  put(row, 0, std::string(columns_, ' '), style);
  put(row, 0, text, style);
}

std::string Canvas::text(std::size_t row) const {
  std::string out;
  for (std::size_t column = 0; column < columns_; ++column) {
    append_utf8(out, at(row, column).character);
  }
  out.erase(out.find_last_not_of(' ') + 1);
  return out;
}

}  // namespace linegate::console
