// SPDX-License-Identifier: Apache-2.0
// The pages of the monitor that are no list.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/tables.h"

namespace linegate::console {

// All that is known of one node: state, identity, errors, its values and its events. Tables are
// fitted to the width.
std::vector<Note> node_page(const Model& model, const LineId& line, std::uint8_t node,
                            std::size_t width);
// The keys.
std::vector<Note> help_page();

// What Model::find() takes for this line alone.
std::string reference_to(const Model& model, const LineId& id);

}  // namespace linegate::console
