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
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/mpdo.h"
#include "stack/routing/emcy_router.h"
#include "stack/storage/parameters.h"
#include "stack/time/service.h"

namespace linegate::line {
namespace {

using od::Access;
using od::DataType;
using od::ObjectType;

constexpr std::uint8_t kErrorHistory = 16;       // entries of 1003h
constexpr std::uint8_t kHeartbeatEntries = 127;  // entries of 1016h

// Name and type of each object are taken from the catalogue.
od::ObjectDescription array(std::uint16_t index, Access access, std::uint8_t count,
                            Access count_access, std::uint8_t count_value) {
  const od::objects::Entry& entry = od::objects::at(index);
  od::ObjectDescription out{
      .index = index, .name = std::string(entry.name), .type = ObjectType::array};
  out.variables.push_back(
      od::number_variable(0, "Number of entries", DataType::unsigned8, count_access, count_value));
  for (unsigned sub = 1; sub <= count; ++sub) {
    out.variables.push_back(od::number_variable(static_cast<std::uint8_t>(sub),
                                                out.name + ' ' + std::to_string(sub), entry.type,
                                                access, 0));
  }
  return out;
}

od::ObjectDescription identity(const Identity& id) {
  return od::identity_object(id.vendor, id.product, id.revision, id.serial);
}

od::ObjectDescription sdo_server(std::uint8_t node) {
  od::ObjectDescription out{
      .index = od::objects::kSdoServer, .name = "SDO server parameter", .type = ObjectType::record};
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

// A manager must not change its state on an error: no other node would start it again.
od::ObjectDescription error_behaviour(Role role) {
  od::ObjectDescription out =
      array(od::objects::kErrorBehaviour, Access::rw, 1, Access::constant, 1);
  store_le(std::span(out.variables[1].value), std::uint64_t{role == Role::manager});
  return out;
}

od::ObjectDescription flying_master_timing(const LineConfig& config) {
  const nmt::FlyingMasterTimes times = flying_master_times(config);
  const auto ms = [](Duration time) {
    return static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
  };
  const std::pair<const char*, std::uint64_t> parameters[] = {
      {"NMT master timeout", ms(times.master_timeout)},
      {"NMT master negotiation time delay", ms(times.negotiation_delay)},
      {"NMT master priority", times.priority},
      {"Priority time slot", ms(times.priority_slot)},
      {"CANopen device time slot", ms(times.device_slot)},
      {"Multiple NMT master detect cycle time", ms(times.detect_cycle)},
  };
  const od::objects::Entry& entry = od::objects::at(od::objects::kFlyingMasterTiming);
  od::ObjectDescription out{.index = od::objects::kFlyingMasterTiming,
                            .name = std::string(entry.name),
                            .type = ObjectType::array};
  out.variables.push_back(od::number_variable(0, "Highest sub-index supported", DataType::unsigned8,
                                              Access::constant, std::size(parameters)));
  for (const auto& [name, value] : parameters) {
    const auto sub = static_cast<std::uint8_t>(out.variables.size());
    out.variables.push_back(od::number_variable(sub, name, entry.type, Access::rw, value));
  }
  return out;
}

// Store and restore parameters, verify configuration.
void add_storage(std::vector<od::ObjectDescription>& objects) {
  constexpr std::uint8_t kGroups = storage::kManufacturer;
  objects.push_back(
      array(od::objects::kStoreParameters, Access::rw, kGroups, Access::constant, kGroups));
  objects.push_back(
      array(od::objects::kRestoreDefaults, Access::rw, kGroups, Access::constant, kGroups));
  objects.push_back(array(od::objects::kVerifyConfiguration, Access::rw, 2, Access::constant, 2));
}

// The additional SDO servers: a client configures one by writing its COB-IDs.
od::ObjectDescription another_sdo_server(unsigned number) {
  od::ObjectDescription out{.index = static_cast<std::uint16_t>(od::objects::kSdoServer + number),
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

// The network-IDs of the lines are in a manufacturer-specific object, sub-index = interface: the
// public texts of CiA 302-7 do not name one.
void add_routing_tables(const routing::Config& routing,
                        std::vector<od::ObjectDescription>& objects) {
  objects.push_back(array(od::objects::kRoutingTable, Access::rw, routing::kMaxRoutes, Access::rw,
                          static_cast<std::uint8_t>(routing.routes.size())));
  for (std::size_t entry = 0; entry < routing.routes.size(); ++entry) {
    store_le(std::span(objects.back().variables[entry + 1].value),
             routing::encode(routing.routes[entry]));
  }
  objects.push_back(array(od::objects::kEmcyRouting, Access::rw, can::kMaxNodeId, Access::constant,
                          can::kMaxNodeId));
  for (std::size_t node = 1; node <= can::kMaxNodeId; ++node) {
    store_le(std::span(objects.back().variables[node].value),
             std::uint64_t{routing.emcy_networks[node]});
  }
  std::uint8_t highest = 0;
  for (const routing::Interface& line : routing.interfaces) {
    highest = line.way == nullptr ? std::max(highest, line.number) : highest;
  }
  objects.push_back(
      array(od::objects::kNetworkIds, Access::ro, highest, Access::constant, highest));
  for (const routing::Interface& line : routing.interfaces) {
    if (line.way == nullptr) {
      store_le(std::span(objects.back().variables[line.number].value), std::uint64_t{line.network});
    }
  }
}

template <class Unit>
std::uint64_t in(Duration duration) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<Unit>(duration).count());
}

// Adds objects of up to 254 entries each; the last object is writable up to its 254th entry.
template <class Entry>
void add_list(std::uint16_t first, const std::vector<Entry>& entries,
              std::vector<od::ObjectDescription>& objects) {
  constexpr std::size_t kMost = 254;
  for (std::size_t begin = 0; begin < entries.size(); begin += kMost) {
    const auto index = static_cast<std::uint16_t>(first + begin / kMost);
    objects.push_back(array(index, Access::rw, kMost, Access::constant, kMost));
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
      od::catalogued_variable(od::objects::kDeviceType, Access::ro, config.identity.device_type),
      od::catalogued_variable(od::objects::kErrorRegister, Access::ro, 0),
      array(od::objects::kErrorHistory, Access::ro, kErrorHistory, Access::rw, 0),
      od::catalogued_variable(od::objects::kSyncCobId, Access::rw,
                              can::kSyncId | (produces_sync ? can::CobId::kProducerBit : 0U)),
      od::catalogued_variable(od::objects::kSyncPeriod, Access::rw,
                              in<microseconds>(config.sync_period)),
      od::catalogued_variable(od::objects::kSyncWindow, Access::rw, 0),
      od::catalogued_variable(od::objects::kGuardTime, Access::rw, 0),
      od::catalogued_variable(od::objects::kLifeTimeFactor, Access::rw, 0),
      od::catalogued_variable(
          od::objects::kTimeCobId, Access::rw,
          can::kTimeId | (produces_time ? time::kProduceBit : time::kConsumeBit)),
      od::catalogued_variable(od::objects::kEmcyCobId, Access::rw, can::kEmcyBase + config.node_id),
      od::catalogued_variable(od::objects::kEmcyInhibitTime, Access::rw, 0),
      array(od::objects::kConsumerHeartbeatTime, Access::rw, kHeartbeatEntries, Access::constant,
            kHeartbeatEntries),
      od::catalogued_variable(od::objects::kProducerHeartbeatTime, Access::rw,
                              in<milliseconds>(config.heartbeat)),
      identity(config.identity),
      od::catalogued_variable(od::objects::kSyncCounterOverflow, Access::rw, 0),
      error_behaviour(config.role),
      sdo_server(config.node_id),
  };
  std::ranges::move(manager::network_objects(node_plans(config), manager_options(config)),
                    std::back_inserter(device.objects));
  std::ranges::move(manager::configuration_objects(node_plans(config)),
                    std::back_inserter(device.objects));
  std::ranges::move(manager::program_objects(node_plans(config)),
                    std::back_inserter(device.objects));
  if (config.flying_master) {
    device.objects.push_back(flying_master_timing(config));
  }
  if (config.routing.interface != 0) {
    // USDO has no records of servers.
    const unsigned servers = config.canopen_fd ? 0 : config.routing.additional_servers;
    for (unsigned number = 1; number <= servers; ++number) {
      device.objects.push_back(another_sdo_server(number));
    }
    add_routing_tables(config.routing, device.objects);
  }
  add_list(od::objects::kScannerList, config.mpdo_scanner, device.objects);
  add_list(od::objects::kDispatcherList, config.mpdo_dispatcher, device.objects);
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
