// SPDX-License-Identifier: Apache-2.0
// The pages of the journal that clients request (request::JournalRead).
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "bridges/request/journal.h"
#include "gateway/exchange/cell.h"
#include "gateway/journal/journal_reader.h"
#include "stack/line/command.h"

namespace linegate::gateway {

// Why there is no page: the refusal and a sentence.
struct PageRefusal {
  line::Refusal refusal{};
  std::string text;

  friend bool operator==(const PageRefusal&, const PageRefusal&) = default;
};

// For clients.
request::JournalRecord record_of(JournalEntry entry);
request::JournalValue value_of(const StoredValue& value);

// One thread at a time; calls block on the disk. The work for a page is bounded, whatever the
// request: kMostScanned events or values are read, and a page has up to kMostRecords events or
// kMostValues values, and JournalPage::kMostBytes.
class JournalPages {
 public:
  static constexpr std::int64_t kMostScanned = 20'000;
  static constexpr std::size_t kMostRecords = 600;
  static constexpr std::size_t kMostValues = 3000;

  // file: the journal, which may not exist yet, and may be replaced by another one.
  explicit JournalPages(std::string file) : file_(std::move(file)) {}

  // A raised flag ends the call with Refusal::cancelled, unless it waits for the disk.
  std::variant<request::JournalPage, PageRefusal> read(const request::JournalRead& request,
                                                       const exchange::Flag& stop);
  // Closes the file until the next read(). An open reader keeps files beside the journal in use
  // that somebody removed.
  void close();

 private:
  // The entries to look at: after `first`, up to `last`.
  struct Window {
    std::int64_t first = 0;
    std::int64_t last = 0;
    bool is_foreign = false;  // the cursor is that of another file
  };
  // What was read of the window, in the order of the page.
  struct Found {
    std::vector<std::int64_t> positions;
    std::size_t added = 0;  // so many of them fit into the page
    bool is_cut = false;    // there may be more in the window
  };
  int open(const exchange::Flag& stop);
  int read_events(const request::JournalRead& request, const Window& window,
                  request::JournalPage& page, Found& found);
  int read_values(const request::JournalRead& request, const Window& window,
                  request::JournalPage& page, Found& found);
  int read_page(const request::JournalRead& request, request::JournalPage& page, bool& is_foreign);
  int begin(const request::JournalRead& request, const JournalReader::Extent& extent,
            Window& window, request::JournalPage& page);
  int limit_window(const request::JournalRead& request, const JournalReader::Extent& extent,
                   Window& window);
  int check_cursor(const request::JournalRead& request, const JournalReader::Extent& extent,
                   Window& window);
  int make_cursor(JournalReader::Table table, std::int64_t position,
                  request::JournalCursor& cursor);

  const std::string file_;
  JournalReader reader_;
  bool is_open_ = false;
};

}  // namespace linegate::gateway
