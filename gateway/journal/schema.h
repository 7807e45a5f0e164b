// SPDX-License-Identifier: Apache-2.0
// The tables of the journal. README.md describes them for those who read the file with another
// program.
#pragma once

namespace linegate::gateway {

inline constexpr int kJournalApplication = 0x4C67'4A6C;  // "LgJl"
inline constexpr int kJournalVersion = 4;
// Files of this version and later ones are read; the first store() makes the tables of the present
// version.
inline constexpr int kOldestJournalVersion = 1;
inline constexpr int kFirstVersionWithValues = 3;
inline constexpr int kFirstVersionWithScalings = 4;

inline constexpr const char* kJournalTables = R"sql(
CREATE TABLE stream(only INTEGER PRIMARY KEY CHECK(only = 1), id INTEGER NOT NULL);
CREATE TABLE lines(name TEXT PRIMARY KEY NOT NULL, number_limit INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE events(
  id INTEGER PRIMARY KEY AUTOINCREMENT, stream INTEGER NOT NULL, incarnation INTEGER NOT NULL,
  line TEXT NOT NULL, number INTEGER NOT NULL, time INTEGER NOT NULL, clock INTEGER NOT NULL,
  kind INTEGER NOT NULL, severity INTEGER NOT NULL, node INTEGER NOT NULL, code INTEGER NOT NULL,
  value INTEGER NOT NULL, data BLOB NOT NULL, text TEXT NOT NULL);
CREATE UNIQUE INDEX events_once ON events(line, stream, number);
CREATE INDEX events_time ON events(time);
)sql";

// Of version 2: whether the last run of the gateway ended in order, and the number of its events
// that are missing and that no event reported.
inline constexpr const char* kLastRunTable = R"sql(
CREATE TABLE last_run(only INTEGER PRIMARY KEY CHECK(only = 1), ended INTEGER NOT NULL,
                      lost INTEGER NOT NULL);
)sql";

// Of version 3: the time of the last transaction, and the value history. `newest` is the row of the
// newest value of the entry, so that no index of value_rows is needed.
inline constexpr const char* kValueTables = R"sql(
ALTER TABLE last_run ADD COLUMN written INTEGER NOT NULL DEFAULT 0;
CREATE TABLE value_entries(
  id INTEGER PRIMARY KEY, line TEXT NOT NULL, direction INTEGER NOT NULL, node INTEGER NOT NULL,
  name TEXT NOT NULL, newest INTEGER NOT NULL DEFAULT 0, UNIQUE(line, direction, node, name));
CREATE TABLE value_rows(
  id INTEGER PRIMARY KEY AUTOINCREMENT, entry INTEGER NOT NULL, time INTEGER NOT NULL,
  clock INTEGER NOT NULL, type INTEGER NOT NULL, bits INTEGER NOT NULL, value INTEGER);
)sql";

// Of version 4: unit, scale and offset of values. `scaling` 0: none.
inline constexpr const char* kScalingTables = R"sql(
CREATE TABLE value_scalings(
  id INTEGER PRIMARY KEY, unit TEXT NOT NULL, scale REAL NOT NULL, offset REAL NOT NULL,
  UNIQUE(unit, scale, offset));
ALTER TABLE value_rows ADD COLUMN scaling INTEGER NOT NULL DEFAULT 0;
)sql";

}  // namespace linegate::gateway
