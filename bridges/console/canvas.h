// SPDX-License-Identifier: Apache-2.0
// A rectangle of character cells, independent of a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/console/table.h"
#include "stack/base/assert.h"

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
  // Precondition: row < rows() and column < columns().
  const Cell& at(std::size_t row, std::size_t column) const {
    LINEGATE_ASSERT(row < rows_ && column < columns_, "the cell is on the canvas");
    return cells_[row * columns_ + column];
  }

  // Draws the text, cut at the right border; ignored outside the canvas. Makes it printable(), see
  // table.h.
  void put(std::size_t row, std::size_t column, std::string_view text, Style style = Style::plain);
  // Draws one row from border to border.
  void fill(std::size_t row, std::string_view text, Style style);

  // One row as UTF-8, without trailing blanks.
  std::string text(std::size_t row) const;

 private:
  std::size_t rows_;
  std::size_t columns_;
  std::vector<Cell> cells_;
};

}  // namespace linegate::console
