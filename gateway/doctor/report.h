// SPDX-License-Identifier: Apache-2.0
// The result of `linegate doctor`, in words and as JSON.
#pragma once

#include <iosfwd>
#include <string>

#include "gateway/doctor/finding.h"
#include "gateway/doctor/observations.h"

namespace linegate::doctor {

void print_report(std::ostream& out, const Observations& seen, const Findings& found);
// One line.
std::string report_json(const Observations& seen, const Findings& found);

}  // namespace linegate::doctor
