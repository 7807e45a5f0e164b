// SPDX-License-Identifier: Apache-2.0
// The findings of a file loader, each with its place. A loader reports all findings at once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace linegate {

enum class Severity : std::uint8_t { note, warning, error };

struct Diagnostic {
  Severity severity = Severity::error;
  std::string file;
  std::uint32_t line = 0;    // from 1; 0 = the whole file
  std::uint32_t column = 0;  // from 1; 0 = the whole line
  std::string text;
};

// "file:line:column: error: text", the form that compilers print; parts that are 0 are omitted.
std::string to_string(const Diagnostic& diagnostic);

// The outcome of loading a file. Warnings may accompany a value; with an error there is no value.
template <class T>
struct Loaded {
  std::optional<T> value;
  std::vector<Diagnostic> diagnostics;

  bool ok() const { return value.has_value(); }
};

inline bool has_errors(const std::vector<Diagnostic>& diagnostics) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [](const Diagnostic& d) { return d.severity == Severity::error; });
}

}  // namespace linegate
