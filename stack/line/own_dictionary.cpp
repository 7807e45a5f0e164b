// SPDX-License-Identifier: Apache-2.0
#include "stack/line/own_dictionary.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/line/build.h"
#include "stack/manager/configuration_objects.h"
#include "stack/manager/network_list.h"
#include "stack/manager/program_objects.h"
#include "stack/od/number_variable.h"
#include "stack/pdo/mpdo.h"
#include "stack/routing/emcy_router.h"
#include "stack/storage/parameters.h"
#include "stack/time/service.h"

namespace linegate::line {
namespace {

using od::Access;
using od::DataType;
using od::ObjectType;

constexpr std::uint16_t kNetworkIds = 0x5F20;
constexpr std::uint8_t kErrorHistory = 16;       // entries of 1003h
constexpr std::uint8_t kHeartbeatEntries = 127;  // entries of 1016h

od::ObjectDescription object(std::uint16_t index, std::string name, DataType type, Access access,
                             std::uint64_t value) {
  od::ObjectDescription out{.index = index, .name = name, .type = ObjectType::variable};
  out.variables.push_back(od::number_variable(0, std::move(name), type, access, value));
  return out;
}

od::ObjectDescription array(std::uint16_t index, std::string name, DataType type, Access access,
                            std::uint8_t count, Access count_access, std::uint8_t count_value) {
  od::ObjectDescription out{.index = index, .name = std::move(name), .type = ObjectType::array};
  out.variables.push_back(
      od::number_variable(0, "Number of entries", DataType::unsigned8, count_access, count_value));
  for (unsigned sub = 1; sub <= count; ++sub) {
    out.variables.push_back(od::number_variable(
        static_cast<std::uint8_t>(sub), out.name + ' ' + std::to_string(sub), type, access, 0));
  }
  return out;
}

od::ObjectDescription identity(const Identity& id) {
  od::ObjectDescription out{.index = 0x1018, .name = "Identity object", .type = ObjectType::record};
  out.variables = {
      od::number_variable(0, "Highest sub-index supported", DataType::unsigned8, Access::constant,
                          4),
      od::number_variable(1, "Vendor-ID", DataType::unsigned32, Access::ro, id.vendor),
      od::number_variable(2, "Product code", DataType::unsigned32, Access::ro, id.product),
      od::number_variable(3, "Revision number", DataType::unsigned32, Access::ro, id.revision),
      od::number_variable(4, "Serial number", DataType::unsigned32, Access::ro, id.serial),
  };
  return out;
}

od::ObjectDescription sdo_server(std::uint8_t node) {
  od::ObjectDescription out{
      .index = 0x1200, .name = "SDO server parameter", .type = ObjectType::record};
  out.variables = {
      od::number_variable(0, "Highest sub-index supported", DataType::unsigned8, Access::constant,
                          2),
      od::number_variable(1, "COB-ID client to server", DataType::unsigned32, Access::ro,
                          can::kSdoRequestBase + node),
      od::number_variable(2, "COB-ID server to client", DataType::unsigned32, Access::ro,
                          can::kSdoResponseBase + node),
  };
  return out;
}

// A manager has nobody who would start it again: it goes on.
od::ObjectDescription error_behaviour(Role role) {
  od::ObjectDescription out =
      array(0x1029, "Error behaviour", DataType::unsigned8, Access::rw, 1, Access::constant, 1);
  store_le(std::span(out.variables[1].value), std::uint64_t{role == Role::manager});
  return out;
}

// Store and restore parameters, verify configuration.
void add_storage(std::vector<od::ObjectDescription>& objects) {
  constexpr std::uint8_t kGroups = storage::kManufacturer;
  objects.push_back(array(0x1010, "Store parameters", DataType::unsigned32, Access::rw, kGroups,
                          Access::constant, kGroups));
  objects.push_back(array(0x1011, "Restore default parameters", DataType::unsigned32, Access::rw,
                          kGroups, Access::constant, kGroups));
  objects.push_back(array(0x1020, "Verify configuration", DataType::unsigned32, Access::rw, 2,
                          Access::constant, 2));
}

// The servers beside the default one: whoever wants one writes its COB-IDs.
od::ObjectDescription another_sdo_server(unsigned number) {
  od::ObjectDescription out{.index = static_cast<std::uint16_t>(0x1200 + number),
                            .name = "SDO server parameter",
                            .type = ObjectType::record};
  out.variables = {
      od::number_variable(0, "Highest sub-index supported", DataType::unsigned8, Access::constant,
                          3),
      od::number_variable(1, "COB-ID client to server", DataType::unsigned32, Access::rw,
                          can::CobId::kInvalidBit),
      od::number_variable(2, "COB-ID server to client", DataType::unsigned32, Access::rw,
                          can::CobId::kInvalidBit),
      od::number_variable(3, "Node-ID of the SDO client", DataType::unsigned8, Access::rw, 0),
  };
  return out;
}

// The networks of the lines are in an object of our own, sub-index = interface: CiA 302-7's public
// texts name none.
void add_routing_tables(const routing::Config& routing,
                        std::vector<od::ObjectDescription>& objects) {
  objects.push_back(array(routing::kRoutingTable, "Routing table", DataType::unsigned64, Access::rw,
                          routing::kMaxRoutes, Access::rw,
                          static_cast<std::uint8_t>(routing.routes.size())));
  for (std::size_t entry = 0; entry < routing.routes.size(); ++entry) {
    store_le(std::span(objects.back().variables[entry + 1].value),
             routing::encode(routing.routes[entry]));
  }
  objects.push_back(array(routing::kEmcyRouting, "EMCY routing", DataType::unsigned32, Access::rw,
                          can::kMaxNodeId, Access::constant, can::kMaxNodeId));
  for (std::size_t node = 1; node <= can::kMaxNodeId; ++node) {
    store_le(std::span(objects.back().variables[node].value),
             std::uint64_t{routing.emcy_networks[node]});
  }
  std::uint8_t highest = 0;
  for (const routing::Interface& line : routing.interfaces) {
    highest = std::max(highest, line.number);
  }
  objects.push_back(array(kNetworkIds, "Network-IDs of the lines", DataType::unsigned16, Access::ro,
                          highest, Access::constant, highest));
  for (const routing::Interface& line : routing.interfaces) {
    store_le(std::span(objects.back().variables[line.number].value), std::uint64_t{line.network});
  }
}

template <class Unit>
std::uint64_t in(Duration duration) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<Unit>(duration).count());
}

// In objects of up to 254 entries each; all of the last one can be written.
template <class Entry>
void add_list(std::uint16_t first, const std::string& name, DataType type,
              const std::vector<Entry>& entries, std::vector<od::ObjectDescription>& objects) {
  constexpr std::size_t kMost = 254;
  for (std::size_t begin = 0; begin < entries.size(); begin += kMost) {
    const auto index = static_cast<std::uint16_t>(first + begin / kMost);
    objects.push_back(array(index, name, type, Access::rw, kMost, Access::constant, kMost));
    for (std::size_t i = begin; i < entries.size() && i < begin + kMost; ++i) {
      store_le(std::span(objects.back().variables[1 + i - begin].value), entries[i]);
    }
  }
}

}  // namespace

od::Dictionary make_own_dictionary(const LineConfig& config) {
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  const bool produces_sync = config.sync_period > Duration::zero();
  const bool produces_time = config.time_period > Duration::zero();
  od::DeviceDescription device;
  device.objects = {
      object(0x1000, "Device type", DataType::unsigned32, Access::ro, config.identity.device_type),
      object(0x1001, "Error register", DataType::unsigned8, Access::ro, 0),
      array(0x1003, "Pre-defined error field", DataType::unsigned32, Access::ro, kErrorHistory,
            Access::rw, 0),
      object(0x1005, "COB-ID SYNC message", DataType::unsigned32, Access::rw,
             can::kSyncId | (produces_sync ? can::CobId::kProducerBit : 0U)),
      object(0x1006, "Communication cycle period", DataType::unsigned32, Access::rw,
             in<microseconds>(config.sync_period)),
      object(0x1007, "Synchronous window length", DataType::unsigned32, Access::rw, 0),
      object(0x100C, "Guard time", DataType::unsigned16, Access::rw, 0),
      object(0x100D, "Life time factor", DataType::unsigned8, Access::rw, 0),
      object(0x1012, "COB-ID time stamp object", DataType::unsigned32, Access::rw,
             can::kTimeId | (produces_time ? time::kProduceBit : time::kConsumeBit)),
      object(0x1014, "COB-ID EMCY", DataType::unsigned32, Access::rw,
             can::kEmcyBase + config.node_id),
      object(0x1015, "Inhibit time EMCY", DataType::unsigned16, Access::rw, 0),
      array(0x1016, "Consumer heartbeat time", DataType::unsigned32, Access::rw, kHeartbeatEntries,
            Access::constant, kHeartbeatEntries),
      object(0x1017, "Producer heartbeat time", DataType::unsigned16, Access::rw,
             in<milliseconds>(config.heartbeat)),
      identity(config.identity),
      object(0x1019, "Synchronous counter overflow value", DataType::unsigned8, Access::rw, 0),
      error_behaviour(config.role),
      sdo_server(config.node_id),
  };
  std::ranges::move(manager::network_objects(node_plans(config), manager_options(config)),
                    std::back_inserter(device.objects));
  std::ranges::move(manager::configuration_objects(node_plans(config)),
                    std::back_inserter(device.objects));
  std::ranges::move(manager::program_objects(node_plans(config)),
                    std::back_inserter(device.objects));
  if (config.routing.interface != 0) {
    for (unsigned number = 1; number <= config.routing.additional_servers; ++number) {
      device.objects.push_back(another_sdo_server(number));
    }
    add_routing_tables(config.routing, device.objects);
  }
  add_list(pdo::kScannerList, "MPDO scanner list", DataType::unsigned32, config.mpdo_scanner,
           device.objects);
  add_list(pdo::kDispatcherList, "MPDO dispatcher list", DataType::unsigned64,
           config.mpdo_dispatcher, device.objects);
  if (config.stores_parameters) {
    add_storage(device.objects);
    storage::mark_parameters(device);
  }
  return od::Dictionary(device);
}

std::vector<od::ObjectDescription> routing_tables(const LineConfig& config) {
  od::DeviceDescription device;
  add_routing_tables(config.routing, device.objects);
  if (config.stores_parameters) {
    storage::mark_parameters(device);
  }
  return std::move(device.objects);
}

}  // namespace linegate::line
