// SPDX-License-Identifier: Apache-2.0
// Describes events in sentences: for logs and Event::text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "stack/base/event.h"
#include "stack/line/config.h"

namespace linegate::gateway {

class ClientDirectory;

// For example "node 5 (drive1): heartbeat lost for 500 ms". At most 256 bytes. clients: the names
// of clients; nullptr: they are named by number. node_id: the node-ID on the bus of an own device,
// 0 = as configured, or unknown. It is named in events of that device if LSS gave it another one.
std::string describe(const Event& event, const line::LineConfig& line, std::string_view interface,
                     const ClientDirectory* clients = nullptr, std::uint8_t node_id = 0);

// can::BusErrorClass bits: "protocol, no acknowledge".
std::string describe_bus_errors(std::uint32_t bits);

}  // namespace linegate::gateway
