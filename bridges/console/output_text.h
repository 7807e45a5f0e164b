// SPDX-License-Identifier: Apache-2.0
// Output states in words: whether a written output was sent, and what it waits for.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bridges/console/model.h"
#include "stack/image/layout.h"
#include "stack/line/replies.h"

namespace linegate::console {

// The answer of CommandKind::output_write and object_write: "by SDO", "by PDO 3, sent", "by PDO 3,
// which waits for: values that were never written: inlet.Mode". Bytes are an answer with a reason
// that is unknown to this version: the text reports that. Empty for every other type of result.
std::string way_text(const line::ReplyData& data, const image::Layout* outputs);

// Whether the answer names output entries, whose names are in their layout only.
bool names_entries(const line::ReplyData& data);

// Whether the answer reports a PDO that was not sent: values of it were never written, the own node
// is not Operational, its turn did not come, the bus does not acknowledge it, or the reason is
// unknown to this version.
bool is_held_back(const line::ReplyData& data);

// The state of an output entry: "sent", "never written", or "waits for: ..." with the reason.
// Precondition: the area is complete.
std::string output_state(const Line& line, std::size_t entry);

// For each group of outputs: the result of its last writes (topic OutputState).
std::vector<std::string> group_texts(const Line& line);
std::string group_text(const OutputStateView& view);

}  // namespace linegate::console
