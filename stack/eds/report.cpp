// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/report.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace linegate::eds {

void Report::add(Severity severity, Place place, std::string text) {
  const bool error = severity == Severity::error;
  errors_ += error ? 1 : 0;
  if (findings_.size() < kKept) {
    findings_.push_back({severity, file_, place.line, place.column, std::move(text)});
  } else {
    ++beyond_;
    errors_beyond_ += error ? 1 : 0;
  }
}

std::vector<Diagnostic> Report::take() {
  std::stable_sort(findings_.begin(), findings_.end(),
                   [](const Diagnostic& a, const Diagnostic& b) {
                     return std::tie(a.line, a.column) < std::tie(b.line, b.column);
                   });
  if (beyond_ != 0) {
    findings_.push_back({errors_beyond_ != 0 ? Severity::error : Severity::warning, file_, 0, 0,
                         std::to_string(beyond_) + " more findings, " +
                             std::to_string(errors_beyond_) + " of them errors"});
  }
  errors_ = beyond_ = errors_beyond_ = 0;
  return std::exchange(findings_, {});
}

}  // namespace linegate::eds
