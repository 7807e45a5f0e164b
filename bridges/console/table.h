// SPDX-License-Identifier: Apache-2.0
// A table as people see it: cells with what they are sorted by, fitted to a width. Nothing here
// knows a terminal.
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

// What a text means; a terminal chooses a colour for it.
enum class Style { plain, headline, bold, good, warning, error, changed, stale, selected };

struct Column {
  std::string title;
  bool right = false;     // its texts end at one column: numbers
  bool flexible = false;  // gives way, down to 14 characters, where there is little room
  bool extra = false;     // may lie beyond the right border: no other gives way for it
};

struct Cell {
  std::string text;
  std::optional<double> number;  // what it is sorted by, ahead of all texts
};

// What a row is about, whatever place it has.
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

// By the cells of one column: numbers first, ascending or descending, then texts. What is equal
// stays in its order.
void sort(Table& table, std::size_t column, bool descending);
// Only rows that have every one of these words in some cell, whatever the case.
void keep_matches(Table& table, const std::vector<std::string>& words);

// Headline and rows as aligned texts. In a width of 0 all of it; else flexible columns give way to
// all that are not extra, and what goes beyond is cut. Of each the first `skip` characters are left
// out.
Text fit(const Table& table, std::size_t width, std::size_t skip);
// The notes, and all of the rest.
Text text_of(const Table& table);

// Texts come from strangers: UTF-8 of one column a character, and '?' for all that could steer a
// terminal or shift what follows.
std::string printable(std::string_view text);
// Its characters; the text is printable().
std::size_t width_of(std::string_view text);
// So many characters from `from` on.
std::string_view cut(std::string_view text, std::size_t from, std::size_t count);
// No longer than that: what is too much is left out in the middle, with a '~' there.
std::string shorten(std::string_view text, std::size_t width);

}  // namespace linegate::console
