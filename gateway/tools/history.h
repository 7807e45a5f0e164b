// SPDX-License-Identifier: Apache-2.0
// `linegate history`: the events of a journal (gateway/journal).
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>

#include "stack/base/time.h"

namespace linegate::gateway {

struct HistoryOptions {
  std::string file;         // of the journal
  std::string line;         // empty: all lines, and the gateway itself
  std::string node;         // "LINE:5", or "5" of each line; empty: all
  std::string kind;         // "heartbeat-lost"; empty: all
  std::string severity;     // "info", "warning" or "error": these and worse; empty: all
  std::string text;         // part of the text; ASCII letters of either case
  std::string since;        // see console::parse_since(); empty: from the oldest event on
  std::string until;        // exclusive; empty: to the newest event
  std::uint64_t count = 0;  // the newest so many; 0 = all
  bool json = false;        // one JSON object for each event
  bool utc = false;         // print times in UTC instead of local time; JSON always has UTC
};

// Prints the events in the order of their publication. now: UTC. continues: called when all stored
// events were printed, waits for some time, and returns whether later ones are printed too; empty =
// they are not, and of a file that replaces a damaged one. Returns the exit code: that of a failure
// if the file cannot be read, that of wrong usage if an option is invalid.
int history(const HistoryOptions& options, Instant now, std::ostream& out, std::ostream& err,
            const std::function<bool()>& continues = {});

}  // namespace linegate::gateway
