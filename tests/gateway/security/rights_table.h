// SPDX-License-Identifier: Apache-2.0
// The tables of deploy/SECURITY.md, with which the tests of this folder compare what they observe.
#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/paths.h"

namespace linegate::security {

// The text of a cell by the first cell of its row and the head of its column.
using Table = std::map<std::string, std::map<std::string, std::string>>;

inline std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> out;
  std::stringstream in(row.substr(1));
  for (std::string cell; std::getline(in, cell, '|');) {
    const std::size_t begin = cell.find_first_not_of(' ');
    out.push_back(begin == std::string::npos
                      ? std::string()
                      : cell.substr(begin, cell.find_last_not_of(' ') - begin + 1));
  }
  return out;
}

// The first table (Markdown) below that heading.
inline Table table_below(const std::string& heading) {
  std::ifstream in(paths::in_repository("deploy/SECURITY.md"));
  std::string row;
  while (std::getline(in, row) && row != heading) {
  }
  while (std::getline(in, row) && row[0] != '|') {
  }
  const std::vector<std::string> heads = cells_of(row);
  std::getline(in, row);  // the line below the heads
  Table out;
  while (std::getline(in, row) && !row.empty()) {
    const std::vector<std::string> cells = cells_of(row);
    EXPECT_EQ(cells.size(), heads.size()) << row;
    for (std::size_t i = 1; i < cells.size(); ++i) {
      EXPECT_TRUE(out[cells[0]].emplace(heads.at(i), cells[i]).second) << row;
    }
  }
  EXPECT_FALSE(out.empty()) << heading;
  return out;
}

// Names each cell that differs.
inline void expect_same(const Table& document, const Table& observed) {
  for (const auto& [row, cells] : document) {
    for (const auto& [column, cell] : cells) {
      const auto found = observed.find(row);
      EXPECT_TRUE(found != observed.end() && found->second.contains(column))
          << row << ", " << column << ": was not observed";
      if (found != observed.end() && found->second.contains(column)) {
        EXPECT_EQ(cell, found->second.at(column)) << row << ", " << column;
      }
    }
  }
  for (const auto& [row, cells] : observed) {
    EXPECT_TRUE(document.contains(row)) << row << " is not in the document";
  }
}

}  // namespace linegate::security
