// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/history.h"

#include <charconv>
#include <optional>
#include <ostream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bridges/console/commands.h"
#include "bridges/console/events.h"
#include "bridges/console/tables.h"
#include "gateway/journal/journal_reader.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {
namespace {

constexpr std::uint64_t kMostOfAPage = 1000;

std::optional<EventSeverity> severity_called(const std::string& text) {
  for (const auto severity : {EventSeverity::info, EventSeverity::warning, EventSeverity::error}) {
    if (text.empty() || text == name(severity)) {
      return severity;
    }
  }
  return std::nullopt;
}

// Sets the line and the node of the query. Returns false if the text is invalid.
bool read_node(const std::string& text, JournalQuery& query) {
  const std::size_t colon = text.rfind(':');
  const std::size_t from = colon == std::string::npos ? 0 : colon + 1;
  unsigned node = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + from, end, node);
  if (error != std::errc{} || rest != end || node > 127 || colon == 0) {
    return false;
  }
  query.node = static_cast<std::uint8_t>(node);
  if (colon != std::string::npos) {
    query.line = text.substr(0, colon);
  }
  return true;
}

// Empty, or what is wrong.
std::string read_options(const HistoryOptions& options, Instant now, JournalQuery& query) {
  const auto time = [&](const std::string& text, std::optional<Instant>& to) {
    to = text.empty() ? std::nullopt : console::parse_since(text, now);
    return text.empty() || to ? std::string()
                              : "'" + text + "' is no time: 10min, 2h, 3d, or 2026-11-21 12:34";
  };
  if (!options.line.empty()) {
    query.line = options.line;
  }
  if (!options.node.empty() && !read_node(options.node, query)) {
    return "'" + options.node + "' is no node: LINE:5, or 5 of each line";
  }
  for (std::size_t i = 0; i < kEventKinds && !options.kind.empty() && !query.kind; ++i) {
    const auto kind = static_cast<EventKind>(i);
    query.kind = options.kind == name(kind) ? std::optional(kind) : std::nullopt;
  }
  if (!options.kind.empty() && !query.kind) {
    return "'" + options.kind + "' is no kind of event, such as heartbeat-lost";
  }
  const auto severity = severity_called(options.severity);
  if (!severity) {
    return "severities are info, warning and error";
  }
  query.least = *severity;
  query.text = options.text;
  const std::string since = time(options.since, query.since);
  return since.empty() ? time(options.until, query.until) : since;
}

std::string_view name(ClockQuality quality) {
  switch (quality) {
    case ClockQuality::free_running:
      return "free-running";
    case ClockQuality::synchronised:
      return "synchronised";
    default:
      return "unknown";
  }
}

std::string json_of(const JournalEntry& entry) {
  std::string data;
  for (const std::byte byte : entry.data) {
    data += fmt::format("{:02X}", static_cast<unsigned>(byte));
  }
  const nlohmann::ordered_json out{{"time", console::date_text(entry.time)},
                                   {"clock", name(entry.clock)},
                                   {"stream", fmt::format("{:016x}", entry.stream)},
                                   {"incarnation", fmt::format("{:016x}", entry.incarnation)},
                                   {"line", entry.line},
                                   {"number", entry.number},
                                   {"kind", name(entry.kind)},
                                   {"severity", name(entry.severity)},
                                   {"node", entry.node},
                                   {"code", entry.code},
                                   {"value", entry.value},
                                   {"data", data},
                                   {"text", entry.text}};
  return out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string text_of(const JournalEntry& entry, bool utc) {
  return fmt::format("{} {} #{} {}: {}",
                     utc ? console::date_text(entry.time) : console::local_text(entry.time),
                     entry.line.empty() ? "gateway" : console::printable(entry.line), entry.number,
                     name(entry.kind), console::printable(entry.text));
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
      out << (options.json ? json_of(entry) : text_of(entry, options.utc)) << '\n';
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
