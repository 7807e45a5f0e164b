// SPDX-License-Identifier: Apache-2.0
// A cause that `linegate doctor` has found.
#pragma once

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

}  // namespace linegate::doctor
