// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/journal_pages.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <sqlite3.h>

namespace linegate::gateway {
namespace {

using request::JournalCursor;
using request::JournalRead;
using request::JournalRecord;

std::size_t most_of(const JournalRead& request, std::size_t limit) {
  return request.most == 0 ? limit : std::min<std::size_t>(request.most, limit);
}

JournalReader::Table table_of(const JournalRead& request) {
  return request.values ? JournalReader::Table::values : JournalReader::Table::events;
}

JournalQuery query_of(const JournalRead& request) {
  return {.line = request.line,
          .node = request.node,
          .kind = request.kind,
          .least = request.least,
          .text = request.text,
          .since = request.since,
          .until = request.until,
          .newest = request.newest_first,
          .most = most_of(request, JournalPages::kMostRecords)};
}

ValueQuery value_query_of(const JournalRead& request) {
  return {.line = request.line,
          .node = request.node,
          .name = request.text,
          .since = request.since,
          .until = request.until,
          .newest = request.newest_first,
          .most = most_of(request, JournalPages::kMostValues)};
}

// Adds the entries that fit; returns their number.
std::size_t add_records(JournalPage&& from, request::JournalPage& to) {
  std::size_t bytes = request::encode(to).size();
  for (JournalEntry& entry : from.entries) {
    JournalRecord record = record_of(std::move(entry));
    bytes += request::encoded_size(record);
    if (bytes > request::JournalPage::kMostBytes)
      break;
    to.records.push_back(std::move(record));
  }
  return to.records.size();
}

// Adds the values that fit; returns their number.
std::size_t add_values(const ValuePage& from, request::JournalPage& to) {
  std::set<request::JournalSeries> known;
  std::size_t bytes = request::encode(to).size();
  for (const StoredValue& one : from.values) {
    request::JournalValue value = value_of(one);
    bytes += request::encoded_size(value, known.insert(value.series).second);
    if (bytes > request::JournalPage::kMostBytes)
      break;
    to.values.push_back(std::move(value));
  }
  return to.values.size();
}

PageRefusal unreadable(int error) {
  if ((error & 0xFF) == SQLITE_INTERRUPT)
    return {line::Refusal::cancelled, "the gateway is stopping"};
  return {line::Refusal::wrong_state, "the journal cannot be read: " + error_text(error)};
}

}  // namespace

request::JournalRecord record_of(JournalEntry entry) {
  return {.stream = entry.stream,
          .incarnation = entry.incarnation,
          .line = std::move(entry.line),
          .number = entry.number,
          .time = entry.time,
          .clock = static_cast<std::uint8_t>(entry.clock),
          .kind = entry.kind,
          .severity = entry.severity,
          .node = entry.node,
          .code = entry.code,
          .value = entry.value,
          .data = std::move(entry.data),
          .text = std::move(entry.text)};
}

request::JournalValue value_of(const StoredValue& value) {
  const od::Scaling scaling = value.scaling ? *value.scaling : od::Scaling{};
  return {.series = {.line = value.entry->line,
                     .direction = static_cast<std::uint8_t>(value.entry->direction),
                     .node = value.entry->node,
                     .type = static_cast<std::uint16_t>(value.type),
                     .bits = value.bits,
                     .name = value.entry->name,
                     .unit = scaling.unit,
                     .scale = scaling.scale,
                     .offset = scaling.offset},
          .time = value.time,
          .clock = static_cast<std::uint8_t>(value.clock),
          .value = value.value};
}

std::variant<request::JournalPage, PageRefusal> JournalPages::read(const JournalRead& request,
                                                                   const exchange::Flag& stop) {
  request::JournalPage page;
  bool is_foreign = false;
  int error = open(stop);
  if (error == SQLITE_OK)
    error = read_page(request, page, is_foreign);
  if (error != SQLITE_OK) {
    is_open_ = false;  // the file may be repaired, or be another one at the next request
    return unreadable(error);
  }
  if (is_foreign) {
    return PageRefusal{line::Refusal::wrong_incarnation,
                       "the cursor is not of this file of the journal: begin without a cursor"};
  }
  return page;
}

void JournalPages::close() {
  reader_ = JournalReader();
  is_open_ = false;
}

int JournalPages::open(const exchange::Flag& stop) {
  if (is_open_ && reader_.is_current() && !reader_.is_replaced())
    return SQLITE_OK;
  reader_ = JournalReader();
  const int error = reader_.open(file_);
  is_open_ = error == SQLITE_OK;
  if (is_open_)
    reader_.stop_when(stop);
  return error;
}

int JournalPages::read_page(const JournalRead& request, request::JournalPage& page,
                            bool& is_foreign) {
  JournalReader::Extent extent;
  Window window;
  const JournalReader::Table table = table_of(request);
  int error = reader_.extent(table, extent);
  error = error == SQLITE_OK ? begin(request, extent, window, page) : error;
  error = error == SQLITE_OK ? make_cursor(table, extent.newest, page.newest) : error;
  is_foreign = window.is_foreign;
  if (error != SQLITE_OK || is_foreign)
    return error;
  Found found;
  error = request.values ? read_values(request, window, page, found)
                         : read_events(request, window, page, found);
  if (error != SQLITE_OK)
    return error;
  std::int64_t reached = request.newest_first ? window.first + 1 : window.last;
  if (found.is_cut)
    reached = found.positions[found.added - 1];
  page.more = request.newest_first ? reached > extent.oldest : reached < extent.newest;
  const bool is_before_all = request.newest_first && window.first == window.last;
  return is_before_all ? SQLITE_OK : make_cursor(table, reached, page.cursor);
}

int JournalPages::read_events(const JournalRead& request, const Window& window,
                              request::JournalPage& page, Found& found) {
  JournalQuery query = query_of(request);
  query.after = window.first;
  query.last = window.last;
  JournalPage read;
  const int error = reader_.read(query, read);
  if (query.newest) {
    std::ranges::reverse(read.entries);
    std::ranges::reverse(read.positions);
  }
  found.positions = std::move(read.positions);
  found.added = add_records(std::move(read), page);
  found.is_cut = found.added < found.positions.size() || found.added == query.most;
  return error;
}

int JournalPages::read_values(const JournalRead& request, const Window& window,
                              request::JournalPage& page, Found& found) {
  ValueQuery query = value_query_of(request);
  query.after = window.first;
  query.last = window.last;
  ValuePage read;
  const int error = reader_.read(query, read);
  page.unknown_entry = !read.is_known;
  if (query.newest) {
    std::ranges::reverse(read.values);
    std::ranges::reverse(read.positions);
  }
  found.added = add_values(read, page);
  found.positions = std::move(read.positions);
  found.is_cut = found.added < found.positions.size() || found.added == query.most;
  return error;
}

// Forwards after the cursor or the event, backwards before the cursor or from the newest entry on.
int JournalPages::begin(const JournalRead& request, const JournalReader::Extent& extent,
                        Window& window, request::JournalPage& page) {
  page.cursor = request.cursor;
  int error = check_cursor(request, extent, window);
  if (error != SQLITE_OK || window.is_foreign)
    return error;
  const auto cursor = static_cast<std::int64_t>(request.cursor.position);
  if (request.newest_first) {
    window.last = cursor == 0 ? extent.newest : cursor - 1;
    return limit_window(request, extent, window);
  }
  window.first = cursor;
  if (cursor == 0 && request.after) {
    bool known = false;
    error = reader_.find(request.line.value_or(""), request.after->stream, request.after->number,
                         window.first, known);
    page.unknown_stream = !known;
  }
  window.first = std::max(window.first, extent.oldest - 1);
  return error == SQLITE_OK ? limit_window(request, extent, window) : error;
}

// Sets the other end of the window. The positions of events have no gaps. Those of values do: the
// newest value of an entry may be much older than all others.
int JournalPages::limit_window(const JournalRead& request, const JournalReader::Extent& extent,
                               Window& window) {
  const bool backwards = request.newest_first;
  const std::int64_t from = backwards ? window.last : window.first;
  std::optional<std::int64_t> reached;
  int error = SQLITE_OK;
  if (request.values) {
    error = reader_.reach(from, kMostScanned, backwards, reached);
  } else {
    reached = backwards ? from - kMostScanned + 1 : from + kMostScanned;
  }
  if (backwards) {
    window.first = std::max(extent.oldest, reached.value_or(extent.oldest)) - 1;
    window.first = std::min(window.first, window.last);
  } else {
    window.last = std::min(extent.newest, reached.value_or(extent.newest));
  }
  return error;
}

// An entry that was removed for its age or for room leaves its cursor valid.
int JournalPages::check_cursor(const JournalRead& request, const JournalReader::Extent& extent,
                               Window& window) {
  const JournalCursor& cursor = request.cursor;
  if (cursor.position == 0)
    return SQLITE_OK;
  if (cursor.position > static_cast<std::uint64_t>(extent.newest)) {
    window.is_foreign = true;
    return SQLITE_OK;
  }
  std::optional<std::uint64_t> check;
  const int error =
      reader_.check_of(table_of(request), static_cast<std::int64_t>(cursor.position), check);
  window.is_foreign = check && *check != cursor.check;
  return error;
}

// Without an entry, which was removed meanwhile: no later one of this file is at the position.
int JournalPages::make_cursor(JournalReader::Table table, std::int64_t position,
                              JournalCursor& cursor) {
  std::optional<std::uint64_t> check;
  const int error = reader_.check_of(table, position, check);
  cursor = {static_cast<std::uint64_t>(position), check.value_or(0)};
  return error;
}

}  // namespace linegate::gateway
