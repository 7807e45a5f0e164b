// SPDX-License-Identifier: Apache-2.0
#include "bridges/request/journal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "bridges/request/field_bytes.h"
#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/od/scaling.h"

namespace linegate::request {
namespace {

// Flags of the request.
constexpr unsigned kOfLine = 1;
constexpr unsigned kOfNode = 2;
constexpr unsigned kOfKind = 4;
constexpr unsigned kSince = 8;
constexpr unsigned kUntil = 16;
constexpr unsigned kAfter = 32;
constexpr unsigned kNewestFirst = 64;
constexpr unsigned kValues = 128;
constexpr unsigned kAllFlags = 255;
// Flags of the page.
constexpr unsigned kMore = 1;
constexpr unsigned kUnknownStream = 2;
constexpr unsigned kPageOfValues = 4;
constexpr unsigned kUnknownEntry = 8;

constexpr std::size_t kLongestName = 64;
constexpr std::size_t kLongestData = 64;
constexpr std::size_t kLongestEventText = 256;
constexpr std::size_t kLongestEntryName = 128;
constexpr std::size_t kMostBits = 64;
constexpr std::size_t kValueBytes = 20;        // of a value of a known series
constexpr std::size_t kFixedSeriesBytes = 26;  // with the lengths of its strings
constexpr std::size_t kFixedRecordBytes = 48;  // of a record, with the lengths of its strings

std::uint64_t nanoseconds(std::optional<Instant> time) {
  return static_cast<std::uint64_t>(time.value_or(Instant{}).time_since_epoch().count());
}
Instant instant(std::uint64_t nanoseconds) {
  return Instant(Duration(static_cast<std::int64_t>(nanoseconds)));
}

std::string_view cut(std::string_view text, std::size_t most) {
  return text.substr(0, most);
}

void write(JournalCursor cursor, FieldWriter& out) {
  out.number(cursor.position, 8);
  out.number(cursor.check, 8);
}
JournalCursor read_cursor(FieldReader& in) {
  const auto position = in.number<std::uint64_t>();
  return {position, in.number<std::uint64_t>()};
}

void write(const JournalRecord& record, FieldWriter& out) {
  out.number(record.stream, 8);
  out.number(record.incarnation, 8);
  out.number(record.number, 8);
  out.number(nanoseconds(record.time), 8);
  out.number(record.clock, 1);
  out.number(static_cast<std::uint8_t>(record.kind), 1);
  out.number(static_cast<std::uint8_t>(record.severity), 1);
  out.number(record.node, 1);
  out.number(record.code, 4);
  out.number(record.value, 4);
  out.sized(cut(record.line, kLongestName), 1);
  out.sized(std::span(record.data).first(std::min(record.data.size(), kLongestData)), 1);
  out.sized(cut(record.text, kLongestEventText), 2);
}

JournalRecord read_record(FieldReader& in) {
  JournalRecord out;
  out.stream = in.number<std::uint64_t>();
  out.incarnation = in.number<std::uint64_t>();
  out.number = in.number<std::uint64_t>();
  out.time = instant(in.number<std::uint64_t>());
  out.clock = in.number<std::uint8_t>();
  out.kind = static_cast<EventKind>(in.number<std::uint8_t>());
  out.severity = static_cast<EventSeverity>(in.number<std::uint8_t>());
  out.node = in.number<std::uint8_t>();
  out.code = in.number<std::uint32_t>();
  out.value = in.number<std::uint32_t>();
  out.line = in.text(1);
  out.data = in.sized(1);
  out.text = in.text(2);
  in.require(out.line.size() <= kLongestName && out.data.size() <= kLongestData &&
             out.text.size() <= kLongestEventText);
  return out;
}

void write(const JournalSeries& series, FieldWriter& out) {
  out.number(series.direction, 1);
  out.number(series.node, 1);
  out.number(series.type, 2);
  out.number(series.bits, 2);
  out.sized(cut(series.line, kLongestName), 1);
  out.sized(cut(series.name, kLongestEntryName), 2);
  out.number(std::bit_cast<std::uint64_t>(series.scale), 8);
  out.number(std::bit_cast<std::uint64_t>(series.offset), 8);
  out.sized(cut(series.unit, od::kLongestUnit), 1);
}

JournalSeries read_series(FieldReader& in) {
  JournalSeries out;
  out.direction = in.number<std::uint8_t>();
  out.node = in.number<std::uint8_t>();
  out.type = in.number<std::uint16_t>();
  out.bits = in.number<std::uint16_t>();
  out.line = in.text(1);
  out.name = in.text(2);
  out.scale = std::bit_cast<double>(in.number<std::uint64_t>());
  out.offset = std::bit_cast<double>(in.number<std::uint64_t>());
  out.unit = in.text(1);
  in.require(std::isfinite(out.scale) && out.scale != 0.0 && std::isfinite(out.offset) &&
             out.unit.size() <= od::kLongestUnit);
  in.require(out.direction <= 1 && out.bits >= 1 && out.bits <= kMostBits &&
             out.line.size() <= kLongestName && out.name.size() <= kLongestEntryName);
  return out;
}

// A series is described where its first value is.
void write(const std::vector<JournalValue>& values, FieldWriter& out) {
  std::map<JournalSeries, std::uint16_t> known;
  for (const JournalValue& value : values) {
    const auto [series, is_new] =
        known.try_emplace(value.series, static_cast<std::uint16_t>(known.size()));
    out.number(series->second, 2);
    if (is_new)
      write(value.series, out);
    out.number(nanoseconds(value.time), 8);
    out.number(value.clock, 1);
    out.number(value.value ? 1U : 0U, 1);
    out.number(value.value.value_or(0), 8);
  }
}

std::vector<JournalValue> read_values(FieldReader& in) {
  std::vector<JournalSeries> known;
  std::vector<JournalValue> out;
  while (in.good() && in.left() > 0) {
    const auto series = in.number<std::uint16_t>();
    in.require(series <= known.size());
    if (in.good() && series == known.size())
      known.push_back(read_series(in));
    JournalValue& value = out.emplace_back();
    value.time = instant(in.number<std::uint64_t>());
    value.clock = in.number<std::uint8_t>();
    const auto valid = in.number<std::uint8_t>();
    const auto bits = in.number<std::uint64_t>();
    in.require(valid <= 1);
    if (in.good()) {
      value.series = known[series];
      value.value = valid == 1 ? std::optional(bits) : std::nullopt;
    }
  }
  return out;
}

}  // namespace

std::vector<std::byte> encode(const JournalRead& request) {
  FieldWriter out;
  out.number((request.line ? kOfLine : 0U) | (request.node ? kOfNode : 0U) |
                 (request.kind ? kOfKind : 0U) | (request.since ? kSince : 0U) |
                 (request.until ? kUntil : 0U) | (request.after ? kAfter : 0U) |
                 (request.newest_first ? kNewestFirst : 0U) | (request.values ? kValues : 0U),
             2);
  out.number(request.node.value_or(0), 1);
  out.number(static_cast<std::uint8_t>(request.kind.value_or(EventKind{})), 1);
  out.number(static_cast<std::uint8_t>(request.least), 1);
  out.number(nanoseconds(request.since), 8);
  out.number(nanoseconds(request.until), 8);
  const EventPosition after = request.after.value_or(EventPosition{});
  out.number(after.stream, 8);
  out.number(after.number, 8);
  write(request.cursor, out);
  out.sized(cut(request.line.value_or(""), JournalRead::kLongestText), 1);
  out.sized(cut(request.text, JournalRead::kLongestText), 1);
  return out.take();
}

const char* decode(std::span<const std::byte> data, JournalRead& to) {
  FieldReader in(data);
  const auto flags = in.number<std::uint16_t>();
  const auto node = in.number<std::uint8_t>();
  const auto kind = in.number<std::uint8_t>();
  const auto least = in.number<std::uint8_t>();
  const auto since = in.number<std::uint64_t>();
  const auto until = in.number<std::uint64_t>();
  const auto stream = in.number<std::uint64_t>();
  const auto number = in.number<std::uint64_t>();
  to.cursor = read_cursor(in);
  std::string line = in.text(1);
  to.text = in.text(1);
  if (!in.complete())
    return "data is not flags, node, kind, severity, since, until, stream, number, cursor, line "
           "and text";
  if (flags > kAllFlags)
    return "the flags have unknown bits";
  if (node > can::kMaxNodeId)
    return "the node is not 0..127";
  if (least > static_cast<std::uint8_t>(EventSeverity::error))
    return "the severity is not 0..2";
  if ((flags & kAfter) != 0 && ((flags & kOfLine) == 0 || (flags & kNewestFirst) != 0))
    return "a stream and number need a line, and the order of publication";
  if ((flags & kValues) != 0 && ((flags & (kOfKind | kAfter)) != 0 || least != 0))
    return "values have no kind, severity, stream and number";
  const auto has = [flags](unsigned flag) { return (flags & flag) != 0; };
  to.line = has(kOfLine) ? std::optional(std::move(line)) : std::nullopt;
  to.node = has(kOfNode) ? std::optional(node) : std::nullopt;
  to.kind = has(kOfKind) ? std::optional(static_cast<EventKind>(kind)) : std::nullopt;
  to.least = static_cast<EventSeverity>(least);
  to.since = has(kSince) ? std::optional(instant(since)) : std::nullopt;
  to.until = has(kUntil) ? std::optional(instant(until)) : std::nullopt;
  to.after = has(kAfter) ? std::optional(EventPosition{stream, number}) : std::nullopt;
  to.newest_first = has(kNewestFirst);
  to.values = has(kValues);
  return nullptr;
}

std::size_t encoded_size(const JournalRecord& record) {
  return kFixedRecordBytes + std::min(record.line.size(), kLongestName) +
         std::min(record.data.size(), kLongestData) +
         std::min(record.text.size(), kLongestEventText);
}

std::size_t encoded_size(const JournalValue& value, bool of_new_series) {
  return kValueBytes + (of_new_series
                            ? kFixedSeriesBytes + std::min(value.series.line.size(), kLongestName) +
                                  std::min(value.series.name.size(), kLongestEntryName) +
                                  std::min(value.series.unit.size(), od::kLongestUnit)
                            : 0);
}

std::vector<std::byte> encode(const JournalPage& page) {
  LINEGATE_ASSERT(page.records.empty() || page.values.empty(), "a page has events or values");
  FieldWriter out;
  out.number((page.more ? kMore : 0U) | (page.unknown_stream ? kUnknownStream : 0U) |
                 (page.values.empty() ? 0U : kPageOfValues) |
                 (page.unknown_entry ? kUnknownEntry : 0U),
             1);
  write(page.cursor, out);
  write(page.newest, out);
  for (const JournalRecord& record : page.records)
    write(record, out);
  write(page.values, out);
  return out.take();
}

std::optional<JournalPage> decode_page(std::span<const std::byte> data) {
  FieldReader in(data);
  JournalPage page;
  const auto flags = in.number<std::uint8_t>();
  page.more = (flags & kMore) != 0;
  page.unknown_stream = (flags & kUnknownStream) != 0;
  page.unknown_entry = (flags & kUnknownEntry) != 0;
  page.cursor = read_cursor(in);
  page.newest = read_cursor(in);
  if ((flags & kPageOfValues) != 0)
    page.values = read_values(in);
  while (in.good() && in.left() > 0)
    page.records.push_back(read_record(in));
  return in.complete() ? std::optional(std::move(page)) : std::nullopt;
}

}  // namespace linegate::request
