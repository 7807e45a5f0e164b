// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/routing/table.h"

namespace linegate::routing {
namespace {

Route route_at(const od::Dictionary& dictionary, std::size_t entry) {
  return decode(
      dictionary.number({od::objects::kRoutingTable, static_cast<std::uint8_t>(entry + 1)})
          .value_or(0));
}

void append_first(const od::Dictionary& dictionary, std::size_t count, std::vector<Route>& out) {
  for (std::size_t entry = 0; entry < std::min(count, kMaxRoutes); ++entry) {
    out.push_back(route_at(dictionary, entry));
  }
}

std::vector<Route> first_routes(const od::Dictionary& dictionary, std::size_t count) {
  std::vector<Route> out;
  append_first(dictionary, count, out);
  return out;
}

}  // namespace

std::vector<Route> routes_of(const od::Dictionary& dictionary) {
  std::vector<Route> out;
  append_routes(dictionary, out);
  return out;
}

void append_routes(const od::Dictionary& dictionary, std::vector<Route>& out) {
  append_first(dictionary, dictionary.number({od::objects::kRoutingTable, 0}).value_or(0), out);
}

Table read_table(const od::Dictionary& dictionary) {
  return Table(routes_of(dictionary));
}

AbortCode TableObject::check_write(od::Address address, std::span<const std::byte> value) {
  std::vector<Route> routes;
  if (address.sub == 0) {
    if (load_le(value) > kMaxRoutes) {
      return AbortCode::value_too_high;
    }
    routes = first_routes(dictionary_, load_le(value));
  } else {
    routes = routes_of(dictionary_);
    if (address.sub > routes.size()) {
      return AbortCode::none;  // checked when it becomes active
    }
    routes[address.sub - 1U] = decode(load_le(value));
  }
  const std::vector<RouteFinding> found = check(routes, interfaces_);
  return found.empty() ? AbortCode::none : abort_of(found.front().fault);
}

}  // namespace linegate::routing
