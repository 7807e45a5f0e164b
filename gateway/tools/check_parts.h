// SPDX-License-Identifier: Apache-2.0
// What the texts and the JSON of `linegate check` share. Private to check*.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/publish/routing_text.h"

namespace linegate::gateway {

// 16 digits.
std::string hex64(std::uint64_t value);
// With the role and the start-up that an own value of 1F80h gives it, whatever is configured.
line::LineConfig as_started(line::LineConfig config);
std::string_view lost_text(manager::ErrorReaction reaction);
InterfaceNames interface_names(const config::Plant& plant);
// They are the same of every line that routes.
std::vector<routing::Route> routes_of(const config::Plant& plant);

}  // namespace linegate::gateway
