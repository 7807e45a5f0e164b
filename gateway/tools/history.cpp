// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/history.h"

#include <ostream>
#include <utility>

#include "bridges/console/history.h"
#include "gateway/journal/journal_pages.h"
#include "gateway/journal/journal_reader.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {
namespace {

constexpr std::uint64_t kMostOfAPage = 1000;

// Empty, or what is wrong.
std::string read_options(const HistoryOptions& options, Instant now, JournalQuery& query) {
  request::JournalRead read;
  const std::string wrong = console::parse_history({.line = options.line,
                                                    .node = options.node,
                                                    .kind = options.kind,
                                                    .severity = options.severity,
                                                    .text = options.text,
                                                    .since = options.since,
                                                    .until = options.until,
                                                    .count = options.count},
                                                   now, read);
  if (!console::history_node_name(options.node).empty()) {
    return console::kNoNodeNames;
  }
  query.line = read.line;
  query.node = read.node;
  query.kind = read.kind;
  query.least = read.least;
  query.text = read.text;
  query.since = read.since;
  query.until = read.until;
  return wrong;
}

}  // namespace

int history(const HistoryOptions& options, Instant now, std::ostream& out, std::ostream& err,
            const std::function<bool()>& continues) {
  JournalQuery query;
  if (const std::string wrong = read_options(options, now, query); !wrong.empty()) {
    err << wrong << '\n';
    return kExitUsage;
  }
  query.newest = options.count != 0;
  query.most = options.count != 0 ? options.count : kMostOfAPage;
  JournalReader reader;
  JournalPage page;
  int error = reader.open(options.file);
  for (bool more = true; error == 0 && more;) {
    // Before the last entries of the previous file are read
    const bool replaced = continues && reader.is_replaced();
    error = reader.read(query, page);
    for (const JournalEntry& entry : page.entries) {
      const request::JournalRecord record = record_of(entry);
      out << (options.json ? console::history_json(record, "")
                           : console::history_text(record, "", options.utc))
          << '\n';
    }
    out << std::flush;
    const bool rest = !query.newest && page.entries.size() == query.most;
    more = rest || (continues && continues());
    query.after = page.position;
    query.newest = false;
    query.most = kMostOfAPage;
    // The gateway may be about to make the file: then the next call tries again
    if (JournalReader next; replaced && !rest && next.open(options.file) == 0) {
      reader = std::move(next);
      query.after = 0;
    }
  }
  if (error != 0) {
    err << options.file << ": the journal cannot be read: " << error_text(error) << '\n';
    return kExitFailed;
  }
  return kExitOk;
}

}  // namespace linegate::gateway
