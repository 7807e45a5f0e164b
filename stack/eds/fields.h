// SPDX-License-Identifier: Apache-2.0
// Typed access to the keys of a section; private to stack/eds.
//
// Every function reports a value that it cannot parse, with its place, and then treats the key as
// missing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "stack/eds/ini.h"

namespace linegate::eds {

class Fields {
 public:
  Fields(const Section& section, Report& report) : section_(section), report_(report) {}

  // nullptr if the key is missing or has no value.
  const Entry* find(std::string_view key) const;

  // UTF-8; empty if missing.
  std::string text(std::string_view key) const;

  // A number in 0..largest.
  std::optional<std::uint64_t> number(std::string_view key, std::uint64_t largest,
                                      Severity severity = Severity::warning) const;

  // The same for a given entry.
  std::optional<std::uint64_t> number_of(const Entry& entry, std::uint64_t largest,
                                         Severity severity = Severity::warning) const;

  // 1 is true; 0 and missing are false.
  bool flag(std::string_view key) const;

  const Section& section() const { return section_; }

 private:
  const Section& section_;
  Report& report_;
};

}  // namespace linegate::eds
