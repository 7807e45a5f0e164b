// What the console knows, as JSON for scripts. One object on one line each.
#pragma once

#include <string>
#include <vector>

#include "bridges/console/model.h"

namespace linegate::console {

// {"lines":[{"gateway":..,"line":..,"role":..,"bus":..,"counters":{..},"nodes":[..]},..]}
std::string lines_json(const std::vector<const Line*>& lines);
// [{"line":..,"node":..,"state":..,..},..]
std::string nodes_json(const std::vector<const Line*>& lines);
// {"line":..,"direction":..,"layout_id":..,"sequence":..,"time":..,"bytes":"hex","entries":[..]};
// entries are null while layout and image do not belong together.
std::string image_json(const Line& line, image::Direction direction);
// {"time":..,"gateway":..,"line":..,"number":..,"kind":..,"node":..,"code":..,"value":..,..}
std::string event_json(const LineId& id, const EventView& event);
// {"ok":true,"data":"hex","value":..} or {"ok":false,"domain":..,"code":..,"text":..}
std::string answer_json(const Client::Answer& answer, const std::string& value);

}  // namespace linegate::console
