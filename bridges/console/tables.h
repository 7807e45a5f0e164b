// What the console knows, as text for people: one line of text each, columns aligned.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "bridges/console/model.h"

namespace linegate::console {

using Text = std::vector<std::string>;

void print(std::ostream& out, const Text& text);

// A headline and the state of each line.
Text lines_table(const Model& model);
// A headline and each node of these lines.
Text nodes_table(const std::vector<const Line*>& lines);
// A headline and each entry of one direction, with its value; says so if nothing is known yet.
Text image_table(const Line& line, image::Direction direction);

std::string event_text(const LineId& id, const EventView& event);
// What was dropped, in a few words after three blanks; empty if nothing was.
std::string dropped_text(const Model& model);
// "12:34:56.789", UTC.
std::string clock_text(Instant utc);
// "2026-11-21T12:34:56.789Z".
std::string date_text(Instant utc);

}  // namespace linegate::console
