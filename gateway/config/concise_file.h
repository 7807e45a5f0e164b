// SPDX-License-Identifier: Apache-2.0
// Concise DCF files (CiA 302-3) that a plant file names.
#pragma once

#include <string>
#include <vector>

#include "gateway/config/reader.h"
#include "stack/manager/plan.h"

namespace linegate::config {

// Returns the writes of the file. name: relative to the plant file. Empty, with an error at that
// place, if the file cannot be read or is not a concise DCF.
std::vector<manager::ObjectWrite> read_concise_file(Findings& findings, const Place& place,
                                                    const std::string& name);

}  // namespace linegate::config
