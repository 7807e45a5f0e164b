// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/journal_reader.h"

#include <algorithm>
#include <bit>
#include <filesystem>
#include <initializer_list>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <sqlite3.h>

#include "gateway/journal/schema.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

constexpr std::string_view kColumns =
    "id, stream, incarnation, line, number, time, clock, kind, severity, node, code, value, data, "
    "text";

// Numbers of one octet in the contract.
std::uint8_t octet(std::int64_t number) {
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(number, 0, 255));
}

JournalEntry entry_of(const Statement& row) {
  JournalEntry out;
  out.stream = std::bit_cast<std::uint64_t>(row.number(1));
  out.incarnation = std::bit_cast<std::uint64_t>(row.number(2));
  out.line = row.text(3);
  out.number = std::bit_cast<std::uint64_t>(row.number(4));
  out.time = Instant(Duration(row.number(5)));
  out.clock = static_cast<ClockQuality>(octet(row.number(6)));
  out.kind = static_cast<EventKind>(octet(row.number(7)));
  out.severity = static_cast<EventSeverity>(octet(row.number(8)));
  out.node = octet(row.number(9));
  out.code = static_cast<std::uint32_t>(row.number(10));
  out.value = static_cast<std::uint32_t>(row.number(11));
  out.data = row.data(12);
  out.text = row.text(13);
  return out;
}

int read_version(Database& database, int& version) {
  int error = SQLITE_OK;
  const auto application = database.number("PRAGMA application_id", error);
  const auto found =
      error == SQLITE_OK ? database.number("PRAGMA user_version", error) : std::nullopt;
  if (error != SQLITE_OK) {
    return error;
  }
  const bool readable = application == kJournalApplication && found >= kOldestJournalVersion &&
                        found <= kJournalVersion;
  version = readable ? static_cast<int>(*found) : 0;
  return readable ? SQLITE_OK : SQLITE_MISMATCH;
}

std::string conditions(const JournalQuery& query) {
  std::string out = "id > ?1 AND severity >= ?2";
  const auto add = [&out](bool wanted, std::string_view condition) {
    if (wanted) {
      out += " AND ";
      out += condition;
    }
  };
  add(query.line.has_value(), "line = ?3");
  add(query.node.has_value(), "node = ?4");
  add(query.kind.has_value(), "kind = ?5");
  add(!query.text.empty(), "instr(lower(text), lower(?6)) > 0");
  add(query.since.has_value(), "time >= ?7");
  add(query.until.has_value(), "time < ?8");
  add(query.last.has_value(), "id <= ?10");
  return out;
}

void bind(Statement& to, const JournalQuery& query) {
  to.bind(1, query.after);
  to.bind(2, static_cast<std::int64_t>(query.least));
  if (query.line) {
    to.bind(3, std::string_view(*query.line));
  }
  if (query.node) {
    to.bind(4, std::int64_t{*query.node});
  }
  if (query.kind) {
    to.bind(5, static_cast<std::int64_t>(*query.kind));
  }
  if (!query.text.empty()) {
    to.bind(6, std::string_view(query.text));
  }
  if (query.since) {
    to.bind(7, query.since->time_since_epoch().count());
  }
  if (query.until) {
    to.bind(8, query.until->time_since_epoch().count());
  }
  to.bind(9, static_cast<std::int64_t>(query.most));
  if (query.last) {
    to.bind(10, *query.last);
  }
}

// The hash FNV-1a, which is the same in each version of the program.
std::uint64_t fnv_1a(std::initializer_list<std::int64_t> numbers, std::string_view text) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325;
  const auto add = [&hash](std::uint64_t octet) { hash = (hash ^ octet) * 0x0000'0100'0000'01B3; };
  for (const std::int64_t number : numbers) {
    for (unsigned shift = 0; shift < 64; shift += 8) {
      add(std::bit_cast<std::uint64_t>(number) >> shift & 0xFFU);
    }
  }
  for (const char c : text) {
    add(static_cast<unsigned char>(c));
  }
  return hash;
}

// Without a writer, SQLite needs to create files beside a journal, unless it is said not to change.
int open_journal(const std::string& file, Database& database, int& version) {
  int error = database.open(file, Database::Use::read);
  error = error == SQLITE_OK ? read_version(database, version) : error;
  const int primary = error & 0xFF;
  std::error_code ignored;
  if ((primary == SQLITE_CANTOPEN || primary == SQLITE_READONLY) &&
      std::filesystem::is_regular_file(file, ignored) &&
      !std::filesystem::exists(file + "-wal", ignored)) {
    error = database.open(file, Database::Use::read_alone);
    error = error == SQLITE_OK ? read_version(database, version) : error;
  }
  if (error != SQLITE_OK) {
    database.close();
  }
  return error;
}

}  // namespace

int JournalReader::open(const std::string& file) {
  file_ = file;
  identity_ = FileIdentity::of(file);
  int version = 0;
  const int error = open_journal(file, database_, version);
  has_values_ = version >= kFirstVersionWithValues;
  has_scalings_ = version >= kFirstVersionWithScalings;
  is_current_ = version == kJournalVersion;
  log_ = FileIdentity::of(file + "-wal");
  return error;
}

bool JournalReader::is_replaced() const {
  const auto is_another = [](const std::string& path, const FileIdentity& than) {
    const FileIdentity now = FileIdentity::of(path);
    return now.inode != 0 && now != than;
  };
  return is_another(file_, identity_) || is_another(file_ + "-wal", log_);
}

// After all entries were removed, the next position is still known.
int JournalReader::extent(Table table, Extent& out) {
  out = {};
  if (table == Table::values && !has_values_) {
    return SQLITE_OK;
  }
  const char* const name = table == Table::events ? "events" : "value_rows";
  int error = SQLITE_OK;
  const auto newest = database_.number(
      fmt::format("SELECT seq FROM sqlite_sequence WHERE name = '{}'", name), error);
  const auto oldest = error == SQLITE_OK
                          ? database_.number(fmt::format("SELECT min(id) FROM {}", name), error)
                          : std::nullopt;
  out.newest = newest.value_or(0);
  // min() of no entry is NULL, which reads as 0
  out.oldest = oldest.value_or(0) > 0 ? *oldest : out.newest + 1;
  return error;
}

int JournalReader::check_of(Table table, std::int64_t position,
                            std::optional<std::uint64_t>& check) {
  check.reset();
  if (table == Table::values && !has_values_) {
    return SQLITE_OK;
  }
  Statement row(database_.get(), table == Table::events
                                     ? "SELECT stream, number, line FROM events WHERE id = ?1"
                                     : "SELECT time, entry, '' FROM value_rows WHERE id = ?1");
  row.bind(1, position);
  const int result = row.step();
  if (result == SQLITE_ROW) {
    check = fnv_1a({row.number(0), row.number(1)}, row.text(2));
  }
  return result == SQLITE_ROW || result == SQLITE_DONE ? SQLITE_OK : result;
}

int JournalReader::find(const std::string& line, std::uint64_t stream, std::uint64_t number,
                        std::int64_t& position, bool& known) {
  constexpr std::string_view kBefore =
      "SELECT id FROM events WHERE line = ?1 AND stream = ?2 AND number <= ?3 "
      "ORDER BY number DESC LIMIT 1";
  constexpr std::string_view kAfter =
      "SELECT id - 1 FROM events WHERE line = ?1 AND stream = ?2 AND number > ?3 "
      "ORDER BY number LIMIT 1";
  position = 0;
  known = false;
  for (const std::string_view query : {kBefore, kAfter}) {
    Statement row(database_.get(), query);
    row.bind(1, std::string_view(line));
    row.bind(2, std::bit_cast<std::int64_t>(stream));
    row.bind(3, std::bit_cast<std::int64_t>(number));
    const int result = row.step();
    if (result == SQLITE_ROW) {
      position = row.number(0);
      known = true;
      return SQLITE_OK;
    }
    if (result != SQLITE_DONE) {
      return result;
    }
  }
  return SQLITE_OK;
}

int JournalReader::read(const JournalQuery& query, JournalPage& page) {
  LINEGATE_ASSERT(query.most >= 1, "a page has room for an entry");
  page.entries.clear();
  page.positions.clear();
  page.position = query.after;
  if (!database_.is_open()) {
    return SQLITE_CANTOPEN;
  }
  // One transaction: an entry that is stored meanwhile is neither read nor passed over
  int result = database_.execute("BEGIN");
  if (result != SQLITE_OK) {
    return result;
  }
  const auto newest = database_.number("SELECT max(id) FROM events", result);
  result = result == SQLITE_OK ? read_rows(query, page) : result;
  database_.execute("COMMIT");
  if (result == SQLITE_OK && (query.newest || page.entries.size() < query.most)) {
    page.position = std::max(page.position, newest.value_or(0));
  }
  return result;
}

int JournalReader::read_rows(const JournalQuery& query, JournalPage& page) {
  // The last parameter has the highest number, so that every position of bind() exists. Between two
  // positions, an index of another column would read all entries
  const std::string select = fmt::format(
      "SELECT {} FROM events {} WHERE {} ORDER BY id {} LIMIT ?9", kColumns,
      query.last ? "NOT INDEXED" : "", conditions(query), query.newest ? "DESC" : "ASC");
  Statement rows(database_.get(), select);
  bind(rows, query);
  int result = SQLITE_OK;
  while ((result = rows.step()) == SQLITE_ROW) {
    page.entries.push_back(entry_of(rows));
    page.positions.push_back(rows.number(0));
    page.position = std::max(page.position, rows.number(0));
  }
  if (query.newest) {
    std::ranges::reverse(page.entries);
    std::ranges::reverse(page.positions);
  }
  return result == SQLITE_DONE ? SQLITE_OK : result;
}

}  // namespace linegate::gateway
