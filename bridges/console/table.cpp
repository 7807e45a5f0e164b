// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/table.h"

#include <algorithm>
#include <cctype>

namespace linegate::console {
namespace {

constexpr std::size_t kLeastWidth = 14;  // of a flexible column

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

bool is_before(const Cell& left, const Cell& right, bool descending) {
  if (left.number && right.number) {
    return descending ? *left.number > *right.number : *left.number < *right.number;
  }
  if (left.number || right.number) {
    return left.number.has_value();
  }
  return descending ? left.text > right.text : left.text < right.text;
}

std::vector<std::size_t> widths_of(const Table& table) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::size_t width = width_of(table.columns[i].title);
    for (const Row& row : table.rows) {
      width = std::max(width, width_of(row.cells[i].text));
    }
    out.push_back(width);
  }
  return out;
}

// Shrinks the widest flexible column, repeatedly.
void give_way(const Table& table, std::vector<std::size_t>& widths, std::size_t too_much) {
  while (too_much > 0) {
    std::size_t widest = table.columns.size();
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      if (table.columns[i].flexible && widths[i] > kLeastWidth &&
          (widest == table.columns.size() || widths[i] > widths[widest])) {
        widest = i;
      }
    }
    if (widest == table.columns.size()) {
      return;
    }
    --widths[widest];
    --too_much;
  }
}

class Aligner {
 public:
  Aligner(const Table& table, std::size_t width, std::size_t skip)
      : columns_(table.columns), widths_(widths_of(table)), width_(width), skip_(skip) {
    std::size_t all = 0;
    std::size_t columns = 0;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      all += columns_[i].extra ? 0 : widths_[i];
      columns += columns_[i].extra ? 0U : 1U;
    }
    const std::size_t gaps = columns - std::min<std::size_t>(columns, 1);
    if (width > 0 && all + 2 * gaps > width) {
      gap_ = 1;
      give_way(table, widths_, all + gaps > width ? all + gaps - width : 0);
    }
  }

  template <class Cells, class GetText>
  std::string line(const Cells& cells, GetText text_of_cell) const {
    std::string out;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const std::string text = shorten(text_of_cell(cells[i]), widths_[i]);
      const std::string room(widths_[i] - width_of(text), ' ');
      const bool last = i + 1 == columns_.size();
      out += columns_[i].right ? room + text : last ? text : text + room;
      out.append(last ? 0 : gap_, ' ');
    }
    const std::size_t count = width_ == 0 ? out.size() : width_;
    return skip_ == 0 && width_of(out) <= count ? out : std::string(cut(out, skip_, count));
  }

 private:
  const std::vector<Column>& columns_;
  std::vector<std::size_t> widths_;
  std::size_t width_;
  std::size_t skip_;
  std::size_t gap_ = 2;
};

}  // namespace

void sort(Table& table, std::size_t column, bool descending) {
  if (column < table.columns.size()) {
    std::stable_sort(table.rows.begin(), table.rows.end(), [&](const Row& left, const Row& right) {
      return is_before(left.cells[column], right.cells[column], descending);
    });
  }
}

void keep_matches(Table& table, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    const std::string wanted = lower_case(word);
    std::erase_if(table.rows, [&](const Row& row) {
      return std::none_of(row.cells.begin(), row.cells.end(), [&](const Cell& cell) {
        return lower_case(cell.text).find(wanted) != std::string::npos;
      });
    });
  }
}

Text fit(const Table& table, std::size_t width, std::size_t skip) {
  const Aligner aligner(table, width, skip);
  Text out{aligner.line(table.columns, [](const Column& column) { return column.title; })};
  for (const Row& row : table.rows) {
    out.push_back(aligner.line(row.cells, [](const Cell& cell) { return cell.text; }));
  }
  return out;
}

Text text_of(const Table& table) {
  Text out;
  for (const Note& note : table.notes) {
    out.push_back(note.text);
  }
  if (!table.rows.empty() || table.notes.empty()) {
    const Text rows = fit(table, 0, 0);
    out.insert(out.end(), rows.begin(), rows.end());
  }
  return out;
}

}  // namespace linegate::console
