// SPDX-License-Identifier: Apache-2.0
// What the console knows, as tables for people.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "bridges/console/filter.h"
#include "bridges/console/model.h"
#include "bridges/console/table.h"

namespace linegate::console {

struct Context;

// How a point in time is printed.
using Stamp = std::string (*)(Instant utc);
// "12:34:56.789", UTC; "-" for Instant{}.
std::string clock_text(Instant utc);
// "2026-11-21T12:34:56.789Z".
std::string date_text(Instant utc);
// "2026-11-21 12:34:56.789", local time; "-" for Instant{}.
std::string local_text(Instant utc);
// date_text or local_text, as context.utc says.
Stamp stamp_of(const Context& context);

enum class Directions { inputs, outputs, both };

// The state of each line. The filter's node has no effect: a line is not one of its nodes.
Table lines_of(const Model& model, const Filter& filter);
// Each node, with its state.
Table nodes_of(const Model& model, const Filter& filter, Stamp stamp = clock_text);
// Each entry of the process image with its value; of an output whether it was sent or what it waits
// for (output_state()), in column kOutputState. Notes name what was not received yet.
constexpr std::size_t kOutputState = 8;
Table values_of(const Model& model, const Filter& filter, Directions directions);
// What happened, the newest first; at most `count`.
Table events_of(const Model& model, const Filter& filter, std::size_t count = Model::kKeptEvents,
                Stamp stamp = clock_text);

// Whether that line is one of them, see Model::find().
bool is_meant(const std::vector<const Line*>& lines, const LineId& id);

void print(std::ostream& out, const Text& text);
// A headline and each entry of one direction, with its value; says so if nothing is known yet.
Text image_table(const Line& line, image::Direction direction);
std::string event_text(const LineId& id, const EventView& event, Stamp stamp);
// What was dropped, in a few words after three blanks; empty if nothing was.
std::string dropped_text(const Model& model);
// "0.2s", "12s", "5min", "3h", "4d": as exactly as people want it.
std::string duration_text(Duration duration);
// The unit that a name ends in, as device files have it: "rpm" of "Velocity [rpm]". Else empty.
std::string_view unit_of(std::string_view name);
// "ok", "-" (not finished), or the letter of CiA 302-2.
std::string boot_text(char boot);
// With what was found: the node's property boot-text, or the words of its letter.
std::string boot_words(const NodeView& node);

Style style_of(const Model& model, const Line& line);
Style style_of(const NodeView& node);
Style style_of(EventSeverity severity);

}  // namespace linegate::console
