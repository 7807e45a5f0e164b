// SPDX-License-Identifier: Apache-2.0
// `linegate history`: stored events and values of gateways; and its conditions and output, which it
// has in common with `linegate history --journal` (gateway/tools/history.h).
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "bridges/request/journal.h"

namespace linegate::console {

struct HistoryRequest {
  std::string line;         // empty: all lines, and the gateway itself
  std::string node;         // "LINE:5", "LINE:NAME", or "5" of each line; empty: all
  std::string kind;         // "heartbeat-lost"; empty: all
  std::string severity;     // "info", "warning" or "error": these and worse; empty: all
  std::string text;         // part of the text; ASCII letters of either case
  std::string since;        // see parse_since(); empty: from the oldest event on
  std::string until;        // exclusive; empty: to the newest event
  std::uint64_t count = 0;  // the newest so many; 0 = all
  // Values instead of events: of entries with these names, `*` is any text; empty: of all.
  bool values = false;
  std::vector<std::string> entries{};
  bool csv = false;  // values as CSV
};

// The name of the node in "LINE:NAME"; empty for other texts. A journal has no names of nodes.
std::string history_node_name(const std::string& node);
inline constexpr const char* kNoNodeNames =
    "a file has no names of nodes: --node LINE:5 with the node-ID";
// Sets the conditions of the request, but a node with a name. now: UTC. Returns an empty text, or
// what is wrong.
std::string parse_history(const HistoryRequest& request, Instant now, request::JournalRead& to);

// One event for people. gateway: precedes the line; empty: is left out.
std::string history_text(const request::JournalRecord& record, const std::string& gateway,
                         bool utc);
// One event as a JSON object, with `gateway` unless it is empty.
std::string history_json(const request::JournalRecord& record, const std::string& gateway);

// The page that answers a request, from a gateway or a file.
struct PageAnswer {
  std::optional<request::JournalPage> page{};
  bool is_foreign = false;  // the cursor is that of another file
  std::string error{};      // without a page
};
using AskForPage = std::function<PageAnswer(const request::JournalRead&)>;
// Where the values of a file are printed, and how.
struct HistoryOutput {
  std::ostream& out;
  std::ostream& err;
  bool json = false;
  bool csv = false;
  bool utc = false;
};
// Prints the values of one journal; the exit code is that of history(). name: for messages.
int values_of(const std::string& name, const AskForPage& ask, const HistoryRequest& request,
              Instant now, const HistoryOutput& output);

// Prints the events or values in the journals of all gateways that are found, by time if there are
// several; request.line and the line of request.node may be "GATEWAY/LINE". follow: then later
// events until stopped() returns true. kFailed if a journal cannot be read, after the events of the
// others, or none has values of an entry, or nothing is stored of a line that no gateway has.
int history(Context& context, const HistoryRequest& request, bool follow,
            const std::function<bool()>& stopped);

}  // namespace linegate::console
