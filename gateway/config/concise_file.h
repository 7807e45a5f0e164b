// SPDX-License-Identifier: Apache-2.0
// Files that a key of a plant file names and that are concise DCFs (CiA 302-3).
#pragma once

#include <string>
#include <vector>

#include "gateway/config/reader.h"
#include "stack/manager/concise_dcf.h"

namespace linegate::config {

// What the file says is to be written. name: relative to the plant file. Nothing if it cannot be
// read or is none, which is told at that place.
std::vector<manager::ObjectWrite> read_concise_file(Findings& findings, const Place& place,
                                                    const std::string& name);

}  // namespace linegate::config
