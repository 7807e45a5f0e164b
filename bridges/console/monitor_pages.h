// SPDX-License-Identifier: Apache-2.0
// The pages of the monitor that are not lists.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/tables.h"

namespace linegate::console {

// Everything known about one node: state, identity, errors, values and events. Tables are fitted to
// the width.
std::vector<Note> node_page(const Model& model, const LineId& line, std::uint8_t node,
                            std::size_t width);
// The page that lists the keys.
std::vector<Note> help_page();

// The text that Model::find() resolves to this line alone.
std::string reference_to(const Model& model, const LineId& id);

}  // namespace linegate::console
