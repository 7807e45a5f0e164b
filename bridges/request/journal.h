// SPDX-License-Identifier: Apache-2.0
// The request that reads the journal of a gateway, and the page that answers it.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/event.h"
#include "stack/base/time.h"
#include "stack/line/command.h"

namespace linegate::request {

// The number of an event of a line, and the stream of that number (`event-stream` of GatewayState).
struct EventPosition {
  std::uint64_t stream = 0;
  std::uint64_t number = 0;

  friend bool operator==(EventPosition, EventPosition) = default;
};

// A position in the file of a journal, at a stored event. The gateway chooses it.
struct JournalCursor {
  std::uint64_t position = 0;  // 0: none
  std::uint64_t check = 0;     // identifies the event at the position: another file has another one

  friend bool operator==(const JournalCursor&, const JournalCursor&) = default;
};

// Reads stored events, or values, that fulfil all conditions. Reply: a JournalPage; of a refusal a
// sentence.
struct JournalRead {
  static constexpr line::CommandKind kKind{26};
  static constexpr std::string_view kName = "journal-read";
  static constexpr std::size_t kLongestText = 255;  // of `line` and `text`, in bytes

  std::optional<std::string> line{};  // "": the gateway itself
  std::optional<std::uint8_t> node{};
  std::optional<EventKind> kind{};
  EventSeverity least = EventSeverity::info;  // this severity and worse ones
  // Part of the text of the event; ASCII letters of either case. Of values: the name of the entry
  // in the process image, in which `*` stands for any text. Empty: all.
  std::string text{};
  std::optional<Instant> since{};  // UTC; inclusive
  std::optional<Instant> until{};  // UTC; exclusive
  // Begins after that event of `line`, which must be set; not with newest_first.
  std::optional<EventPosition> after{};
  JournalCursor cursor{};     // of the page before; it then replaces `after`
  bool newest_first = false;  // from the newest event back
  std::uint32_t most = 0;     // events or values of the page; 0 = as many as fit
  bool values = false;        // of the value history; then without kind, severity and `after`
};

// The members of an Event sample (idl/linegate.idl) but `gateway`, and the stream of its number.
struct JournalRecord {
  std::uint64_t stream = 0;
  std::uint64_t incarnation = 0;
  std::string line{};  // empty: the gateway itself
  std::uint64_t number = 0;
  Instant time{};          // UTC
  std::uint8_t clock = 0;  // ClockQuality of the contract
  EventKind kind{};        // kinds that are unknown to this version keep their number
  EventSeverity severity{};
  std::uint8_t node = 0;
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::vector<std::byte> data{};  // up to 64 bytes
  std::string text{};             // up to 256 bytes

  friend bool operator==(const JournalRecord&, const JournalRecord&) = default;
};

// An entry of a process image with a value history, and the type and scaling of its value.
struct JournalSeries {
  std::string line{};
  std::uint8_t direction = 0;  // 0 inputs, 1 outputs
  std::uint8_t node = 0;
  std::uint16_t type = 0;  // CiA 301 data type
  std::uint16_t bits = 0;  // 1..64
  std::string name{};      // of the entry, up to 128 bytes
  std::string unit{};      // up to 32 bytes
  // The value in the unit is the one that the bits mean * scale + offset.
  double scale = 1.0;  // finite, not 0
  double offset = 0.0;

  friend auto operator<=>(const JournalSeries&, const JournalSeries&) = default;
};

// A value from its time on, until the next one of the same line, direction, node and name.
struct JournalValue {
  JournalSeries series{};
  Instant time{};          // UTC
  std::uint8_t clock = 0;  // ClockQuality of the contract
  // Bits of the value, the first one is the lowest. Nothing: from that time on there is no valid
  // value, or none is known.
  std::optional<std::uint64_t> value{};

  friend bool operator==(const JournalValue&, const JournalValue&) = default;
};

// Begins the sentence of the refusal by a gateway that has no journal, and will have none before it
// starts again; it refuses with Refusal::wrong_state, like one that cannot read its journal now.
inline constexpr std::string_view kNoJournal = "this gateway has no journal";

// In the order in which the events or values were stored, or the reverse order with newest_first. A
// page may be empty although there are more: the gateway bounds the work for a page.
struct JournalPage {
  static constexpr std::size_t kMostBytes = 60'000;  // encoded: 8 samples of a reply

  JournalCursor cursor{};  // of the next page
  // At the newest event, or value, of the journal, whatever the conditions are.
  JournalCursor newest{};
  bool more = false;  // the page does not reach the end
  // The journal has no event of the line with the stream of `after`: the page begins with the
  // oldest event instead.
  bool unknown_stream = false;
  bool unknown_entry = false;  // no entry with a value history fulfils the conditions
  std::vector<JournalRecord> records{};
  std::vector<JournalValue> values{};  // without records

  friend bool operator==(const JournalPage&, const JournalPage&) = default;
};

// The data of the request and of the reply: idl/COMMANDS.md.
std::vector<std::byte> encode(const JournalRead& request);
// Returns nullptr, or a description of the error.
const char* decode(std::span<const std::byte> data, JournalRead& to);
// The encoded size of a page with these records is at most that of the empty page and their sum.
std::size_t encoded_size(const JournalRecord& record);
// of_new_series: the page has no earlier value of the series.
std::size_t encoded_size(const JournalValue& value, bool of_new_series);
// Longer strings than the contract permits are cut.
std::vector<std::byte> encode(const JournalPage& page);
std::optional<JournalPage> decode_page(std::span<const std::byte> data);

}  // namespace linegate::request
