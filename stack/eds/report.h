// SPDX-License-Identifier: Apache-2.0
// Collects the findings of all parts of a reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stack/base/diagnostic.h"

namespace linegate::eds {

// A position in the file, from 1; 0 = the whole file, or the whole line.
struct Place {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

class Report {
 public:
  // The first kKept findings are kept with their text; the rest are counted.
  static constexpr std::size_t kKept = 1000;

  explicit Report(std::string_view file) : file_(file) {}

  void note(Place place, std::string text) { add(Severity::note, place, std::move(text)); }
  void warning(Place place, std::string text) { add(Severity::warning, place, std::move(text)); }
  void error(Place place, std::string text) { add(Severity::error, place, std::move(text)); }
  void add(Severity severity, Place place, std::string text);

  bool has_errors() const { return errors_ != 0; }

  // All findings in the order of the file, and a last one with the number of findings beyond kKept.
  // The report is empty afterwards.
  std::vector<Diagnostic> take();

 private:
  std::string file_;
  std::vector<Diagnostic> findings_;
  std::size_t errors_ = 0;
  std::size_t beyond_ = 0;
  std::size_t errors_beyond_ = 0;
};

}  // namespace linegate::eds
