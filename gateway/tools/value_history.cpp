// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/value_history.h"

#include <utility>
#include <variant>

#include "gateway/journal/journal_pages.h"

namespace linegate::gateway {

int value_history(const std::string& file, const console::HistoryRequest& request, Instant now,
                  const console::HistoryOutput& output) {
  JournalPages pages(file);
  const exchange::Flag never;
  const auto ask = [&](const request::JournalRead& read) {
    console::PageAnswer out;
    auto result = pages.read(read, never);
    if (auto* const refusal = std::get_if<PageRefusal>(&result)) {
      out.is_foreign = refusal->refusal == line::Refusal::wrong_incarnation;
      out.error = std::move(refusal->text);
    } else {
      out.page = std::get<request::JournalPage>(std::move(result));
    }
    return out;
  };
  return console::values_of(file, ask, request, now, output);
}

}  // namespace linegate::gateway
