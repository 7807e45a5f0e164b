// SPDX-License-Identifier: Apache-2.0
// The model of the console as JSON for scripts, one object on each line.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/filter.h"
#include "bridges/console/model.h"
#include "stack/od/data_type.h"

namespace linegate::console {

// {"lines":[{"gateway":..,"line":..,"role":..,"bus":..,"counters":{..},"nodes":[..]},..]}
std::string lines_json(const Model& model, const std::vector<const Line*>& lines);
// [{"line":..,"node":..,"state":..,..},..]
std::string nodes_json(const std::vector<const Line*>& lines);
// {"line":..,"direction":..,"layout_id":..,"sequence":..,"time":..,"bytes":"hex","pdos":[..],
// "entries":[..]}. pdos are those received or sent since the previous sample, with the last time.
// entries is null while layout and image do not match. The value of an entry is a number, true or
// false, or text by its data type; "nan", "inf" or "-inf" for a real that is not a number; null if
// it is not valid.
std::string image_json(const Line& line, image::Direction direction);
// {"time":..,"gateway":..,"line":..,"number":..,"kind":..,"node":..,"code":..,"value":..,..}
std::string event_json(const LineId& id, const EventView& event);
// Everything at once: {"time":..,"lines":[{..,"inputs":{..},"outputs":{..}},..],"events":[..],
// "dropped":{..}}, restricted to the line and node of the filter; its words have no effect.
std::string plant_json(const Model& model, const Filter& filter, Instant utc);
// The same in pieces, one object a line, each with its "type": "lines", "image" or "event".
std::string stream_lines_json(const Model& model, const Filter& filter);
std::string stream_image_json(const Line& line, image::Direction direction, std::uint8_t node);
std::string stream_event_json(const LineId& id, const EventView& event);
// A value of an entry, as image_json() prints it: in its unit if it is scaled. Bytes that are no
// UTF-8 are replaced.
std::string json_of_value(const image::Entry& entry, std::span<const std::byte> value);
// {"ok":true,"data":"hex","value":..} or {"ok":false,"domain":..,"code":..,"text":..}
std::string answer_json(const Client::Answer& answer, const std::string& value);

}  // namespace linegate::console
