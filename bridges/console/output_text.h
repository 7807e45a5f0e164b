// SPDX-License-Identifier: Apache-2.0
// Outputs in words: what became of one that was written, and what it waits for.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bridges/console/model.h"
#include "stack/image/layout.h"

namespace linegate::console {

// What CommandKind::output_write and object_write answer (line::ObjectWay): "by PDO 3, sent", "by
// PDO 3, which waits for: values that were never written: inlet.Mode". Empty for no data.
std::string way_text(const std::vector<std::byte>& data, const image::Layout* outputs);

// Of the same data: it names entries of the outputs, which have names in their layout only.
bool names_entries(const std::vector<std::byte>& data);

// Of the same data: the PDO was not sent: values of it were never written, the own node is not
// Operational, its turn did not come, or the bus does not acknowledge it.
bool is_held_back(const std::vector<std::byte>& data);

// Of an entry of the outputs: "sent", "never written", or "waits for: ..." with what keeps its PDO.
// Precondition: the area is complete.
std::string output_state(const Line& line, std::size_t entry);

// Of each group of outputs, what became of the writes to it (topic OutputState).
std::vector<std::string> group_texts(const Line& line);
std::string group_text(const OutputStateView& view);

}  // namespace linegate::console
