// SPDX-License-Identifier: Apache-2.0
// Object 1F2Ch in a dictionary: what it holds now, and what may be written to it.
#pragma once

#include <vector>

#include "stack/od/dictionary.h"
#include "stack/od/hook.h"
#include "stack/routing/table.h"

namespace linegate::routing {

// The routes that count, in the order of their sub-indices; unused ones among them.
std::vector<Route> routes_of(const od::Dictionary& dictionary);
void append_routes(const od::Dictionary& dictionary, std::vector<Route>& out);
Table read_table(const od::Dictionary& dictionary);

// Refuses what would bring a fault into the table, with abort_of(RouteFault): a route that counts,
// or a number of routes that makes others count. More than 254 routes: value_too_high.
class TableObject final : public od::Hook {
 public:
  // Both must outlive it.
  TableObject(const od::Dictionary& dictionary, const std::vector<Interface>& interfaces)
      : dictionary_(dictionary), interfaces_(interfaces) {}

  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;

 private:
  const od::Dictionary& dictionary_;
  const std::vector<Interface>& interfaces_;
};

}  // namespace linegate::routing
