// SPDX-License-Identifier: Apache-2.0
// A value of the value history as a line of text, JSON or CSV.
#pragma once

#include <string>
#include <string_view>

#include "bridges/request/journal.h"

namespace linegate::console {

// gateway: precedes the line; empty: is left out.
std::string value_history_text(const request::JournalValue& value, const std::string& gateway,
                               bool utc);
// One JSON object, with `gateway` unless it is empty. The value is that of `linegate image --json`,
// in the unit that its entry had when it was stored, or null if it is not valid.
std::string value_history_json(const request::JournalValue& value, const std::string& gateway);
// The time is UTC; a value that is not valid is empty. The head has the names of the columns.
std::string value_history_csv(const request::JournalValue& value, const std::string& gateway);
inline constexpr std::string_view kValueCsvHead = "time,gateway,line,direction,entry,value,unit";

// ClockQuality of the contract.
std::string_view clock_name(std::uint8_t quality);

}  // namespace linegate::console
