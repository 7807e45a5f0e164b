// SPDX-License-Identifier: Apache-2.0
// Reads the events and values of a journal, also while another process writes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/journal/database.h"
#include "gateway/journal/entry.h"
#include "gateway/journal/file_identity.h"
#include "gateway/journal/stored_value.h"

namespace linegate::gateway {

// Entries that fulfil all conditions.
struct JournalQuery {
  std::optional<std::string> line;  // "": the gateway itself
  std::optional<std::uint8_t> node;
  std::optional<EventKind> kind;
  EventSeverity least = EventSeverity::info;  // this severity and worse ones
  std::string text;                           // part of the text; ASCII letters of either case
  std::optional<Instant> since;               // UTC; inclusive
  std::optional<Instant> until;               // UTC; exclusive
  std::int64_t after = 0;                     // position: only entries that were stored later
  std::optional<std::int64_t> last{};         // position: only entries up to it
  bool newest = false;                        // the newest `most` entries instead of the oldest
  std::size_t most = 1000;                    // entries, >= 1
};

// In the order in which the entries were stored.
struct JournalPage {
  std::vector<JournalEntry> entries;
  std::vector<std::int64_t> positions;  // of the entries
  std::int64_t position = 0;  // `after` of the next page; passes over entries that do not match
};

// Values that fulfil all conditions.
struct ValueQuery {
  std::optional<std::string> line{};
  std::optional<std::uint8_t> node{};
  std::string name;                    // of the entry, `*` is any text; empty: all
  std::optional<Instant> since{};      // UTC; inclusive
  std::optional<Instant> until{};      // UTC; exclusive
  std::int64_t after = 0;              // position: only values that were stored later
  std::optional<std::int64_t> last{};  // position: only values up to it
  bool newest = false;                 // the newest `most` values instead of the oldest
  std::size_t most = 1000;             // values, >= 1
};

// In the order in which the values were stored, which is that of their times for each entry.
struct ValuePage {
  std::vector<StoredValue> values;
  std::vector<std::int64_t> positions;  // of the values
  bool is_known = false;  // an entry of the value history fulfils the conditions of the query
};

class JournalReader {
 public:
  // 0 or the result code of SQLite: SQLITE_NOTADB or SQLITE_MISMATCH if the file is no journal of
  // a known version. A file on a read-only medium can be read if no process writes it.
  int open(const std::string& file);
  int read(const JournalQuery& query, JournalPage& page);
  // A journal without a value history has no values.
  int read(const ValueQuery& query, ValuePage& page);
  // Calls end with SQLITE_INTERRUPT while the flag is raised. It must exist while this is open.
  void stop_when(const exchange::Flag& flag) { database_.stop_when(flag); }

  enum class Table : std::uint8_t { events, values };
  // The positions of the oldest and the newest entry of the table. Without entries, the oldest one
  // is after the newest one.
  struct Extent {
    std::int64_t oldest = 1;
    std::int64_t newest = 0;
  };
  int extent(Table table, Extent& out);
  // The position of the value number `count` (>= 1) after, or with backwards up to and before, that
  // position; nothing if there are fewer. Between kept values positions may be missing.
  int reach(std::int64_t from, std::int64_t count, bool backwards,
            std::optional<std::int64_t>& position);
  // A number that differs for the entries at the same position of two files; nothing if there is no
  // entry at the position.
  int check_of(Table table, std::int64_t position, std::optional<std::uint64_t>& check);
  // The position of the entry, after which all entries are later than it. If it is not stored: that
  // of the nearest one of the stream before the next one that is. known: the line has an entry of
  // the stream; else the position is 0.
  int find(const std::string& line, std::uint64_t stream, std::uint64_t number,
           std::int64_t& position, bool& known);

  // Whether open() found the tables of this version: an earlier one becomes this one with the next
  // store(), and must then be opened again.
  bool is_current() const { return is_current_; }
  // Whether the name belongs to another file since open(): the gateway moved a damaged one away. Or
  // whether the log of SQLite does: somebody removed it, and the gateway made another one. What is
  // read is still the previous one.
  bool is_replaced() const;

 private:
  using Entries = std::map<std::int64_t, std::shared_ptr<const ValueEntry>>;

  int read_rows(const JournalQuery& query, JournalPage& page);
  using Scalings = std::map<std::int64_t, std::shared_ptr<const od::Scaling>>;

  int read_scalings(Scalings& scalings);
  int select_entries(const ValueQuery& query, Entries& selected, bool& all);
  int read_values(const ValueQuery& query, const Entries& entries, bool all, ValuePage& page);

  std::string file_;
  FileIdentity identity_;
  FileIdentity log_;  // of SQLite
  Database database_;
  bool has_values_ = false;    // the tables of the value history
  bool has_scalings_ = false;  // with units and scalings
  bool is_current_ = false;
};

}  // namespace linegate::gateway
