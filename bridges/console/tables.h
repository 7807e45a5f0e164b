// SPDX-License-Identifier: Apache-2.0
// The model of the console as tables.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "bridges/console/filter.h"
#include "bridges/console/model.h"
#include "bridges/console/table.h"

namespace linegate::console {

struct Context;

// Formats a time.
using Stamp = std::string (*)(Instant utc);
// "12:34:56.789", UTC; "-" for Instant{}.
std::string clock_text(Instant utc);
// "2026-11-21T12:34:56.789Z".
std::string date_text(Instant utc);
// "2026-11-21 12:34:56.789", local time; "-" for Instant{}.
std::string local_text(Instant utc);
// date_text or local_text, selected by context.utc.
Stamp stamp_of(const Context& context);

enum class Directions { inputs, outputs, both };

// The state of each line. The node of the filter has no effect.
Table lines_of(const Model& model, const Filter& filter);
// The state of each node.
Table nodes_of(const Model& model, const Filter& filter, Stamp stamp = clock_text);
// Each entry of the process image with its value. Column kOutputState of an output: sent, or what
// it waits for (output_state()). Notes name what was not received yet.
constexpr std::size_t kOutputState = 8;
Table values_of(const Model& model, const Filter& filter, Directions directions);
// Events, newest first; at most `count`.
Table events_of(const Model& model, const Filter& filter, std::size_t count = Model::kKeptEvents,
                Stamp stamp = clock_text);

// Whether that line is in the list, see Model::find().
bool is_meant(const std::vector<const Line*>& lines, const LineId& id);

void print(std::ostream& out, const Text& text);
// A headline and each entry of one direction with its value; a message if nothing is known yet.
Text image_table(const Line& line, image::Direction direction);
std::string event_text(const LineId& id, const EventView& event, Stamp stamp);
// The number of dropped samples in words, after three blanks; empty if there are none.
std::string dropped_text(const Model& model);
// "0.2s", "12s", "5min", "3h", "4d": rounded for display.
std::string duration_text(Duration duration);
// "ok", "-" (not finished), or the letter of CiA 302-2.
std::string boot_text(char boot);
// The boot result with its finding: the node's property boot-text, or the words for its letter.
std::string boot_words(const NodeView& node);

Style style_of(const Model& model, const Line& line);
Style style_of(const NodeView& node);
Style style_of(EventSeverity severity);

}  // namespace linegate::console
