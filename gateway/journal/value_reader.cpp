// SPDX-License-Identifier: Apache-2.0
// The queries of JournalReader for values.
#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <sqlite3.h>

#include "gateway/journal/journal_reader.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

// `*` of the pattern is any text, also none.
bool matches_name(std::string_view pattern, std::string_view name) {
  std::size_t at = 0;
  std::size_t star = std::string_view::npos;  // the last one in the pattern
  std::size_t retry = 0;                      // where in the name the text after it is tried next
  for (std::size_t i = 0; i < name.size();) {
    if (at < pattern.size() && pattern[at] == '*') {
      star = at++;
      retry = i;
    } else if (at < pattern.size() && pattern[at] == name[i]) {
      ++at;
      ++i;
    } else if (star != std::string_view::npos) {
      at = star + 1;
      i = ++retry;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', at) == std::string_view::npos;
}

std::uint8_t octet_of(std::int64_t number) {
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(number, 0, 255));
}

// entries: numbers of the file, or a query of them. Rows of other entries must not count as rows of
// the page.
std::string value_conditions(const ValueQuery& query, const std::string& entries) {
  std::string out = "id > ?1";
  if (query.since) {
    out += " AND time >= ?2";
  }
  if (query.until) {
    out += " AND time < ?3";
  }
  if (query.last) {
    out += " AND id <= ?5";
  }
  return out + " AND entry IN (" + entries + ")";
}

void bind_values(Statement& to, const ValueQuery& query) {
  to.bind(1, query.after);
  if (query.since) {
    to.bind(2, query.since->time_since_epoch().count());
  }
  if (query.until) {
    to.bind(3, query.until->time_since_epoch().count());
  }
  to.bind(4, static_cast<std::int64_t>(query.most));
  if (query.last) {
    to.bind(5, *query.last);
  }
}

StoredValue value_of(const Statement& row, std::shared_ptr<const ValueEntry> entry) {
  StoredValue out;
  out.entry = std::move(entry);
  out.time = Instant(Duration(row.number(2)));
  out.clock = static_cast<ClockQuality>(octet_of(row.number(3)));
  out.type = static_cast<od::DataType>(std::clamp<std::int64_t>(row.number(4), 0, 0xFFFF));
  out.bits = static_cast<std::uint16_t>(std::clamp<std::int64_t>(row.number(5), 1, 64));
  if (row.number(7) == 0) {
    out.value = std::bit_cast<std::uint64_t>(row.number(6));
  }
  return out;
}

}  // namespace

int JournalReader::read(const ValueQuery& query, ValuePage& page) {
  LINEGATE_ASSERT(query.most >= 1, "a page has room for a value");
  page = {};
  if (!has_values_) {
    return database_.is_open() ? SQLITE_OK : SQLITE_CANTOPEN;
  }
  // One transaction: an entry that is made meanwhile has no value in it
  int result = database_.execute("BEGIN");
  Entries entries;
  bool all = false;
  result = result == SQLITE_OK ? select_entries(query, entries, all) : result;
  page.is_known = !entries.empty();
  if (result == SQLITE_OK && page.is_known) {
    result = read_values(query, entries, all, page);
  }
  database_.execute("COMMIT");
  return result;
}

int JournalReader::reach(std::int64_t from, std::int64_t count, bool backwards,
                         std::optional<std::int64_t>& position) {
  position.reset();
  if (!has_values_) {
    return SQLITE_OK;
  }
  Statement row(database_.get(),
                backwards
                    ? "SELECT id FROM value_rows WHERE id <= ?1 ORDER BY id DESC LIMIT 1 OFFSET ?2"
                    : "SELECT id FROM value_rows WHERE id > ?1 ORDER BY id LIMIT 1 OFFSET ?2");
  row.bind(1, from);
  row.bind(2, count - 1);
  const int result = row.step();
  if (result == SQLITE_ROW) {
    position = row.number(0);
  }
  return result == SQLITE_ROW || result == SQLITE_DONE ? SQLITE_OK : result;
}

// all: each entry of the file is selected.
int JournalReader::select_entries(const ValueQuery& query, Entries& selected, bool& all) {
  Statement rows(database_.get(), "SELECT id, line, direction, node, name FROM value_entries");
  int result = SQLITE_OK;
  all = true;
  while ((result = rows.step()) == SQLITE_ROW) {
    ValueEntry entry{
        .line = rows.text(1),
        .direction = rows.number(2) == 0 ? image::Direction::inputs : image::Direction::outputs,
        .node = octet_of(rows.number(3)),
        .name = rows.text(4)};
    if ((!query.line || entry.line == *query.line) && (!query.node || entry.node == *query.node) &&
        (query.name.empty() || matches_name(query.name, entry.name))) {
      selected[rows.number(0)] = std::make_shared<const ValueEntry>(std::move(entry));
    } else {
      all = false;
    }
  }
  return result == SQLITE_DONE ? SQLITE_OK : result;
}

// A scaling that no entry can have, in a file that another program wrote, is none.
int JournalReader::read_scalings(Scalings& scalings) {
  if (!has_scalings_) {
    return SQLITE_OK;
  }
  Statement rows(database_.get(), "SELECT id, unit, scale, offset FROM value_scalings");
  int result = SQLITE_OK;
  while ((result = rows.step()) == SQLITE_ROW) {
    od::Scaling scaling{rows.text(1), rows.real(2), rows.real(3)};
    if (scaling.unit.size() <= od::kLongestUnit && std::isfinite(scaling.scale) &&
        scaling.scale != 0.0 && std::isfinite(scaling.offset)) {
      scalings[rows.number(0)] = std::make_shared<const od::Scaling>(std::move(scaling));
    }
  }
  return result == SQLITE_DONE ? SQLITE_OK : result;
}

int JournalReader::read_values(const ValueQuery& query, const Entries& entries, bool all,
                               ValuePage& page) {
  Scalings scalings;
  if (const int error = read_scalings(scalings); error != SQLITE_OK) {
    return error;
  }
  std::string list = all ? "SELECT id FROM value_entries" : "";
  for (auto one = entries.begin(); !all && one != entries.end(); ++one) {
    list += fmt::format("{}{}", list.empty() ? "" : ",", one->first);
  }
  Statement rows(database_.get(),
                 fmt::format("SELECT id, entry, time, clock, type, bits, value, value IS NULL, {} "
                             "FROM value_rows WHERE {} ORDER BY id {} LIMIT ?4",
                             has_scalings_ ? "scaling" : "0", value_conditions(query, list),
                             query.newest ? "DESC" : "ASC"));
  bind_values(rows, query);
  int result = SQLITE_OK;
  while ((result = rows.step()) == SQLITE_ROW) {
    if (const auto entry = entries.find(rows.number(1)); entry != entries.end()) {
      page.values.push_back(value_of(rows, entry->second));
      if (const auto scaling = scalings.find(rows.number(8)); scaling != scalings.end()) {
        page.values.back().scaling = scaling->second;
      }
      page.positions.push_back(rows.number(0));
    }
  }
  if (query.newest) {
    std::ranges::reverse(page.values);
    std::ranges::reverse(page.positions);
  }
  return result == SQLITE_DONE ? SQLITE_OK : result;
}

}  // namespace linegate::gateway
