// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/journal_pages.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include <sqlite3.h>

namespace linegate::gateway {
namespace {

using request::JournalCursor;
using request::JournalRead;
using request::JournalRecord;

JournalQuery query_of(const JournalRead& request) {
  return {.line = request.line,
          .node = request.node,
          .kind = request.kind,
          .least = request.least,
          .text = request.text,
          .since = request.since,
          .until = request.until,
          .newest = request.newest_first,
          .most = request.most == 0
                      ? JournalPages::kMostRecords
                      : std::min<std::size_t>(request.most, JournalPages::kMostRecords)};
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

int JournalPages::open(const exchange::Flag& stop) {
  if (is_open_ && !reader_.is_replaced())
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
  int error = reader_.extent(JournalReader::Table::events, extent);
  error = error == SQLITE_OK ? begin(request, extent, window, page) : error;
  error = error == SQLITE_OK ? make_cursor(extent.newest, page.newest) : error;
  is_foreign = window.is_foreign;
  if (error != SQLITE_OK || is_foreign)
    return error;
  JournalQuery query = query_of(request);
  query.after = window.first;
  query.last = window.last;
  JournalPage found;
  error = reader_.read(query, found);
  if (error != SQLITE_OK)
    return error;
  if (query.newest) {
    std::ranges::reverse(found.entries);
    std::ranges::reverse(found.positions);
  }
  const std::vector<std::int64_t> positions = found.positions;
  const std::size_t most = query.most;
  const std::size_t added = add_records(std::move(found), page);
  const bool is_cut = added < positions.size() || added == most;
  std::int64_t reached = query.newest ? window.first + 1 : window.last;
  if (is_cut)
    reached = positions[added - 1];
  page.more = query.newest ? reached > extent.oldest : reached < extent.newest;
  const bool is_before_all = query.newest && window.first == window.last;
  return is_before_all ? SQLITE_OK : make_cursor(reached, page.cursor);
}

// Forwards after the cursor or the event, backwards before the cursor or from the newest entry on.
int JournalPages::begin(const JournalRead& request, const JournalReader::Extent& extent,
                        Window& window, request::JournalPage& page) {
  page.cursor = request.cursor;
  int error = check_cursor(request.cursor, extent, window);
  if (error != SQLITE_OK || window.is_foreign)
    return error;
  const auto cursor = static_cast<std::int64_t>(request.cursor.position);
  if (request.newest_first) {
    window.last = cursor == 0 ? extent.newest : cursor - 1;
    window.first = std::max(extent.oldest - 1, window.last - kMostScanned);
    window.first = std::min(window.first, window.last);
    return SQLITE_OK;
  }
  window.first = cursor;
  if (cursor == 0 && request.after) {
    bool known = false;
    error = reader_.find(request.line.value_or(""), request.after->stream, request.after->number,
                         window.first, known);
    page.unknown_stream = !known;
  }
  window.first = std::max(window.first, extent.oldest - 1);
  window.last = std::min(extent.newest, window.first + kMostScanned);
  return error;
}

// An entry that was removed for its age or for room leaves its cursor valid.
int JournalPages::check_cursor(const JournalCursor& cursor, const JournalReader::Extent& extent,
                               Window& window) {
  if (cursor.position == 0)
    return SQLITE_OK;
  if (cursor.position > static_cast<std::uint64_t>(extent.newest)) {
    window.is_foreign = true;
    return SQLITE_OK;
  }
  std::optional<std::uint64_t> check;
  const int error = reader_.check_of(JournalReader::Table::events,
                                     static_cast<std::int64_t>(cursor.position), check);
  window.is_foreign = check && *check != cursor.check;
  return error;
}

// Without an entry, which was removed meanwhile: no later one of this file is at the position.
int JournalPages::make_cursor(std::int64_t position, JournalCursor& cursor) {
  std::optional<std::uint64_t> check;
  const int error = reader_.check_of(JournalReader::Table::events, position, check);
  cursor = {static_cast<std::uint64_t>(position), check.value_or(0)};
  return error;
}

}  // namespace linegate::gateway
