// SPDX-License-Identifier: Apache-2.0
// A rectangle of character cells to draw on. Nothing here knows a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/console/table.h"

namespace linegate::console {

class Canvas {
 public:
  struct Cell {
    char32_t character = U' ';
    Style style = Style::plain;
  };

  Canvas(std::size_t rows, std::size_t columns);

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  // Within rows() and columns().
  const Cell& at(std::size_t row, std::size_t column) const {
    return cells_[row * columns_ + column];
  }

  // Cut at the right border; nothing happens outside. Printable or not: see table.h.
  void put(std::size_t row, std::size_t column, std::string_view text, Style style = Style::plain);
  // One row from border to border.
  void fill(std::size_t row, std::string_view text, Style style);

  // One row as UTF-8, without the blanks at its end.
  std::string text(std::size_t row) const;

 private:
  std::size_t rows_;
  std::size_t columns_;
  std::vector<Cell> cells_;
};

}  // namespace linegate::console
