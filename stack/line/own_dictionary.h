// SPDX-License-Identifier: Apache-2.0
// The object dictionary of a line's own node, before PDO records and network variables are added.
#pragma once

#include <vector>

#include "stack/line/config.h"
#include "stack/od/dictionary.h"

namespace linegate::line {

// 1000h to 1019h and 1200h with the values of the configuration; with routing also 1201h and
// following, 1F2Ch and 5F20h (sub-index = interface: the network-ID of that line, 0 = none). Never
// fails, because the objects are fixed.
od::Dictionary make_own_dictionary(const LineConfig& config);

// The objects that describe the routes to other networks: 1F2Ch, 1F2Fh, 5F20h.
std::vector<od::ObjectDescription> routing_tables(const LineConfig& config);

}  // namespace linegate::line
