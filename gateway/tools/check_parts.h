// SPDX-License-Identifier: Apache-2.0
// Shared by the text and JSON output of `linegate check`, and `linegate idl`. Private to this room.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/publish/routing_text.h"
#include "stack/manager/object_write.h"

namespace linegate::gateway {

// 16 digits.
std::string hex64(std::uint64_t value);
// With the role and start-up that the line's own value of 1F80h selects, which overrides the
// configured ones.
line::LineConfig as_started(line::LineConfig config);
std::string_view lost_text(manager::ErrorReaction reaction);
InterfaceNames interface_names(const config::Plant& plant);
// The downloads of the configured values of its DCF, XDC or concise DCF, before those of `objects`;
// without PDO parameters, which are printed as PDOs.
std::vector<manager::ObjectWrite> writes_of_file(const line::NodeConfig& node);
// All lines that route have the same routes.
std::vector<routing::Route> routes_of(const config::Plant& plant);
// The ways over other gateways, see routing::Interface::way.
std::vector<routing::Interface> ways_of(const config::Plant& plant);

}  // namespace linegate::gateway
