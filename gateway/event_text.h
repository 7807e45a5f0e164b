// An event in words, for people: logs and Event::text.
#pragma once

#include <string>

#include "stack/base/event.h"
#include "stack/line/config.h"

namespace linegate::gateway {

// For example "node 5 (drive1): heartbeat lost for 500 ms". At most 256 bytes.
std::string describe(const Event& event, const line::LineConfig& line, std::string_view interface);

}  // namespace linegate::gateway
