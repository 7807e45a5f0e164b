// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/fields.h"

#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {

const Entry* Fields::find(std::string_view key) const {
  const Entry* entry = section_.find(key);
  return entry == nullptr || entry->value.empty() ? nullptr : entry;
}

std::string Fields::text(std::string_view key) const {
  const Entry* entry = find(key);
  return entry == nullptr ? std::string() : to_utf8(entry->value);
}

std::optional<std::uint64_t> Fields::number(std::string_view key, std::uint64_t largest,
                                            Severity severity) const {
  const Entry* entry = find(key);
  return entry == nullptr ? std::nullopt : number_of(*entry, largest, severity);
}

std::optional<std::uint64_t> Fields::number_of(const Entry& entry, std::uint64_t largest,
                                               Severity severity) const {
  const std::string_view content = without_comment(entry.value);
  const Number number = parse_number(content);
  std::string problem = number.problem;
  if (number.ok() && (number.negative || number.magnitude > largest)) {
    problem = quote(content) + " is not in 0 to " + std::to_string(largest);
  }
  const std::string key(entry.key);
  if (!problem.empty()) {
    report_.add(severity, entry.value_place,
                key + ": " + problem + (severity == Severity::error ? "" : "; ignored"));
    return std::nullopt;
  }
  if (!number.remark.empty()) {
    report_.warning(entry.value_place, key + ": " + number.remark);
  }
  return number.magnitude;
}

bool Fields::flag(std::string_view key) const {
  return number(key, 1).value_or(0) == 1;
}

}  // namespace linegate::eds
