// SPDX-License-Identifier: Apache-2.0
// A cause that `linegate doctor` has found.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace linegate::doctor {

struct Finding {
  std::string cause;              // short and stable, for programs: "other-domain"
  std::vector<std::string> seen;  // what was observed; never empty
  std::string means;              // what follows from it
  std::string advice;             // what to do
};

using Findings = std::vector<Finding>;

// Further ones of a kind that a stranger can multiply are left out.
inline constexpr std::size_t kMostFindings = 100;

}  // namespace linegate::doctor
