// SPDX-License-Identifier: Apache-2.0
// Routes between networks: object 1F2Ch, which assigns an interface to each reachable network (CiA
// 302-7). The public texts do not give its layout; this one is OWN definition B, see README.md.
//
//   1F2Ch:0       U8   rw  number of active routes, 0..254
//   1F2Ch:1..254  U64  rw  bits  0..15  first network-ID
//                          bits 16..31  last network-ID
//                          bits 32..39  interface, 1..255; 0 = the entry is not used
//                          bits 40..47  node-ID of the next gateway on that interface; 0 = the
//                                       network is the interface's own
//                          bits 48..63  cost
//
// The route with the lowest cost is used; of equal ones that with the lowest sub-index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"
#include "stack/routing/gateway_request.h"

namespace linegate::routing {

inline constexpr std::size_t kMaxRoutes = 254;

struct Route {
  std::uint16_t first = 0;  // range of network-IDs, 1..65535
  std::uint16_t last = 0;
  std::uint8_t interface = 0;  // 1..255; 0 = not used
  std::uint8_t gateway = 0;  // node-ID on that interface; 0 = the network is that of the interface
  std::uint16_t cost = 0;

  bool used() const { return interface != 0; }
  bool reaches(std::uint16_t network) const { return network >= first && network <= last; }
  friend bool operator==(const Route&, const Route&) = default;
};

std::uint64_t encode(const Route& route);
Route decode(std::uint64_t entry);

// A line of this process, or a way over another gateway.
struct Interface {
  std::uint8_t number = 0;    // 1..255
  std::uint16_t network = 0;  // its network-ID
  std::uint8_t node = 0;      // node-ID of the own node on it; 0 = there is none
  std::string name{};         // of the line, for messages
  // Not nullptr: the networks are reached over that gateway, see GatewayEgress. `network` and
  // `node` are 0.
  std::shared_ptr<const GatewayWay> way{};
};
// The way with that number; nullptr if the interface is a line, or does not exist.
std::shared_ptr<const GatewayWay> find_way(std::span<const Interface> interfaces,
                                           std::uint8_t number);

// An error in a route.
enum class RouteFault : std::uint8_t {
  none,
  bad_range,          // network 0, or last is less than first
  unknown_interface,  // no line of this process has the number
  bad_gateway,        // not a node-ID
  not_attached,       // no gateway, but the network is not that of the interface
  // The route leads back: the next gateway is the own node, or the only network of the route is the
  // one that the gateway is on; over another gateway, a network of the route is that of a line of
  // this process
  loop,
  overlap,  // two routes of equal cost to one network
};
std::string_view describe(RouteFault fault);
// The abort code for a write that would cause the error.
AbortCode abort_of(RouteFault fault);

// Checks one route by itself. Unused routes have no errors.
RouteFault check(const Route& route, std::span<const Interface> interfaces);

struct RouteFinding {
  RouteFault fault = RouteFault::none;
  std::size_t entry = 0;  // position in routes, from 0
  std::size_t other = 0;  // overlap: position of the earlier route
};
// Checks all routes, each by itself and against the others.
std::vector<RouteFinding> check(std::span<const Route> routes,
                                std::span<const Interface> interfaces);

class Table {
 public:
  Table() = default;
  explicit Table(std::span<const Route> routes);

  // The best route to the network. Excludes the interface not_over, from which the request came (0:
  // excludes none), and the `skip` best routes, which have failed. nullptr if there is none left.
  const Route* find(std::uint16_t network, std::uint8_t not_over, std::size_t skip = 0) const;

 private:
  std::vector<Route> routes_;  // used routes, best first
};

// --- object 1F2Ch in a dictionary ---------------------------------------------------------------

// The active routes in the order of their sub-indices, including unused entries.
std::vector<Route> routes_of(const od::Dictionary& dictionary);
void append_routes(const od::Dictionary& dictionary, std::vector<Route>& out);
Table read_table(const od::Dictionary& dictionary);

// Refuses writes that would cause an error in the table, with abort_of(RouteFault): of an active
// route, or of a number of routes that activates others. More than 254 routes: value_too_high.
class TableObject final : public od::Hook {
 public:
  // Both references must outlive this object.
  TableObject(const od::Dictionary& dictionary, const std::vector<Interface>& interfaces)
      : dictionary_(dictionary), interfaces_(interfaces) {}

  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;

 private:
  const od::Dictionary& dictionary_;
  const std::vector<Interface>& interfaces_;
};

}  // namespace linegate::routing
