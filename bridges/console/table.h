// SPDX-License-Identifier: Apache-2.0
// A table for display: cells with sort keys, fitted to a width, independent of a terminal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/console/client.h"

namespace linegate::console {

using Text = std::vector<std::string>;

// The meaning of a text; the screen selects a colour for it.
enum class Style { plain, headline, bold, good, warning, error, changed, stale, selected };

struct Column {
  std::string title;
  bool right = false;     // right-aligned: numbers
  bool flexible = false;  // shrinks, down to 14 characters, where the width is short
  bool extra = false;     // may lie beyond the right border: no other column shrinks for it
};

struct Cell {
  std::string text;
  std::optional<double> number;  // sort key, before all texts
};

// Identifies a row, whatever its position.
struct RowKey {
  LineId id;
  std::uint8_t node = 0;     // 0 = the line itself
  std::uint64_t number = 0;  // of the entry or event

  friend bool operator==(const RowKey&, const RowKey&) = default;
};

struct Row {
  RowKey key;
  std::vector<Cell> cells;  // as many as columns
  Style style = Style::plain;
};

struct Note {
  std::string text;
  Style style = Style::warning;
};

struct Table {
  std::vector<Column> columns;
  std::vector<Row> rows;
  std::vector<Note> notes;  // what is not in the rows, and why
};

// Sorts by one column: numbers first, ascending or descending, then texts. The sort is stable.
void sort(Table& table, std::size_t column, bool descending);
// Keeps the rows in which each of these words occurs in some cell, in any case.
void keep_matches(Table& table, const std::vector<std::string>& words);

// Formats headline and rows as aligned texts. Width 0: without a limit; otherwise flexible columns
// shrink in favour of the columns that are not extra, and the rest is cut. The first `skip`
// characters of each row are omitted.
Text fit(const Table& table, std::size_t width, std::size_t skip);
// The notes and the whole table.
Text text_of(const Table& table);

// Makes a foreign text safe for a terminal: UTF-8 characters of one column, and '?' for everything
// that could control the terminal or shift the columns.
std::string printable(std::string_view text);
// Number of characters. Precondition: the text is printable().
std::size_t width_of(std::string_view text);
// `count` characters from `from` on.
std::string_view cut(std::string_view text, std::size_t from, std::size_t count);
// At most `width` characters: a '~' replaces the middle of longer texts.
std::string shorten(std::string_view text, std::size_t width);

}  // namespace linegate::console
