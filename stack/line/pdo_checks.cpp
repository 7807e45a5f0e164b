// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_checks.h"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/hex_text.h"
#include "stack/can/cob_id.h"
#include "stack/line/build.h"
#include "stack/line/srdo_plan.h"
#include "stack/od/objects.h"
#include "stack/pdo/mapping.h"

namespace linegate::line {
namespace {

struct IdentifierUser {
  std::string name;
  bool certain = true;
};
// By identifier; bit 31 marks 29-bit identifiers.
using IdentifierUsers = std::map<std::uint32_t, IdentifierUser>;

std::uint32_t identifier(can::CobId cob_id) {
  return cob_id.id() | (cob_id.extended() ? can::CobId::kExtendedBit : 0U);
}

bool has_own_value(const LineConfig& config, std::uint16_t index) {
  return std::ranges::any_of(config.own_values, [index](const ObjectValue& value) {
    return value.address.index == index;
  });
}

// The COB-ID in an object of the own node: the last value that is written to it, else the default.
can::CobId own_cob_id(const LineConfig& config, std::uint16_t index, std::uint32_t by_default) {
  can::CobId out{by_default};
  for (const ObjectValue& value : config.own_values) {
    if (value.address == od::Address{index, 0} && value.data.size() == sizeof out.raw) {
      out.raw = load_le<std::uint32_t>(value.data.data());
    }
  }
  return out;
}

std::string name_of(std::uint8_t id, const std::string& name) {
  return name.empty() ? "node" + std::to_string(id) : name;
}

// A device that sends EMCY has 1014h (CiA 301), but device files are often incomplete.
bool says_emcy(const NodeConfig& node) {
  constexpr od::Address kObject{od::objects::kEmcyCobId, 0};
  return node.device.find(kObject) != nullptr ||
         std::ranges::find(node.objects, kObject, &ObjectValue::address) != node.objects.end();
}

IdentifierUsers services_of(const LineConfig& config) {
  IdentifierUsers out;
  for (const NodeConfig& node : config.nodes) {
    if (const can::CobId emcy = emcy_cob_id(node); emcy.valid()) {
      out.emplace(identifier(emcy),
                  IdentifierUser{"the EMCY of " + name_of(node.id, node.name), says_emcy(node)});
    }
  }
  if (config.node_id != 0) {
    const can::CobId emcy =
        own_cob_id(config, od::objects::kEmcyCobId, can::kEmcyBase + config.node_id);
    if (emcy.valid()) {
      out.emplace(identifier(emcy), IdentifierUser{"the EMCY of the own node"});
    }
  }
  out.emplace(identifier(own_cob_id(config, od::objects::kSyncCobId, can::kSyncId)),
              IdentifierUser{"SYNC"});
  if (config.time_period > Duration::zero()) {
    out.emplace(identifier(own_cob_id(config, od::objects::kTimeCobId, can::kTimeId)),
                IdentifierUser{"TIME"});
  }
  return out;
}

// A warning for nodes that were scanned or are only observed, because they run as they are; an
// error in the configuration of this line can be corrected.
Severity severity_in(const LineConfig& config) {
  const bool found = config.role == Role::observer || !config.scanned.empty() ||
                     std::ranges::any_of(config.nodes, &NodeConfig::as_found);
  return found ? Severity::warning : Severity::error;
}

std::string text_of(const pdo::RemoteNode& node, std::string_view kind,
                    const pdo::Parameters& each) {
  return std::string(kind) + ' ' + std::to_string(each.number) + " of " +
         name_of(node.id, node.name);
}

// Calls work(remote node, "TPDO" or "RPDO", parameters) for each PDO.
template <class Work>
void for_each_pdo(std::span<const pdo::RemoteNode> remotes, const Work& work) {
  for (const pdo::RemoteNode& node : remotes) {
    for (const pdo::Parameters& each : node.pdos.tpdos) {
      work(node, pdo::name(pdo::PdoKind::tpdo), each);
    }
    for (const pdo::Parameters& each : node.pdos.rpdos) {
      work(node, pdo::name(pdo::PdoKind::rpdo), each);
    }
  }
}

// CANopen FD: values of whole bytes, no transmission types by remote frame.
void check_for_fd(const pdo::RemoteNode& node, std::string_view kind, const pdo::Parameters& each,
                  std::vector<Diagnostic>& out) {
  const auto report = [&](const std::string& what) {
    out.push_back({.severity = Severity::error,
                   .file = node.device->file,
                   .text = text_of(node, kind, each) + what});
  };
  if (each.type == pdo::kRtrOnSync || each.type == pdo::kRtrEvent) {
    report(" has transmission type " + std::to_string(each.type) + ", which CANopen FD lacks");
  }
  for (const pdo::Mapping& mapping : each.mapping) {
    if (pdo::check_granularity(mapping, 8 * can::kMaxFdData) != AbortCode::none) {
      report(" maps " + od::to_text(mapping.address) + " with " + std::to_string(mapping.bits) +
             " bits: CANopen FD maps whole bytes");
    }
  }
}

bool says_producer(std::span<const std::byte> cob_id) {
  return cob_id.size() == sizeof(std::uint32_t) &&
         (load_le<std::uint32_t>(cob_id.data()) & can::CobId::kProducerBit) != 0;
}

bool produces_sync(const NodeConfig& node) {
  const od::VariableDescription* const described =
      node.device.find(od::Address{od::objects::kSyncCobId, 0});
  return (described != nullptr && says_producer(described->value)) ||
         std::ranges::any_of(node.objects, [](const ObjectValue& object) {
           return object.address.index == od::objects::kSyncCobId && says_producer(object.data);
         });
}

// "685h", with at least three digits.
// Calls work(object, COB-ID) for each SDO channel of the node, 1201h to 12FFh, with the values that
// are written to it.
template <class Work>
void for_each_sdo_channel(const NodeConfig& node, const Work& work) {
  const auto is_channel = [](od::Address address) {
    return address.index > od::objects::kSdoServer &&
           address.index <= od::objects::kLastSdoClient && (address.sub == 1 || address.sub == 2);
  };
  std::map<od::Address, can::CobId> channels;
  const auto take = [&](od::Address address, const std::vector<std::byte>& value) {
    if (is_channel(address) && value.size() == sizeof(std::uint32_t)) {
      channels[address] = can::CobId{load_le<std::uint32_t>(value.data())};
    }
  };
  for (const od::ObjectDescription& object : node.device.objects) {
    for (const od::VariableDescription& variable : object.variables) {
      take({object.index, variable.sub}, variable.value);
    }
  }
  for (const ObjectValue& object : node.objects) {
    take(object.address, object.data);
  }
  for (const auto& [address, cob_id] : channels) {
    if (can::is_usable(cob_id)) {
      work(address, cob_id);
    }
  }
}

// All identifiers of the configuration, and their users.
IdentifierUsers users_of(const LineConfig& config, std::span<const pdo::RemoteNode> remotes) {
  IdentifierUsers out = services_of(config);
  for_each_pdo(remotes, [&](const pdo::RemoteNode& node, std::string_view kind,
                            const pdo::Parameters& each) {
    if (each.cob_id.valid()) {
      out.emplace(identifier(each.cob_id), IdentifierUser{text_of(node, kind, each)});
    }
  });
  for (const NodeConfig& node : config.nodes) {
    for_each_sdo_channel(node, [&](od::Address address, can::CobId cob_id) {
      out.emplace(identifier(cob_id), IdentifierUser{"object " + hex_text(address.index, 3) +
                                                     " of " + name_of(node.id, node.name)});
    });
  }
  for (const auto* const pdos : {&config.forwarding.tpdos, &config.forwarding.rpdos}) {
    for (const pdo::Parameters& each : *pdos) {
      if (each.cob_id.valid()) {
        out.emplace(identifier(each.cob_id),
                    IdentifierUser{"PDO " + std::to_string(each.number) + " of the own node"});
      }
    }
  }
  return out;
}

void add_sleep(const LineConfig& config, IdentifierUsers& out) {
  if (config.sleep.exists()) {
    out.emplace(config.sleep.request, IdentifierUser{"the requests of sleep"});
    out.emplace(config.sleep.objection, IdentifierUser{"the objections to sleep"});
  }
}

std::vector<pdo::RemoteNode> remotes_of(const LineConfig& config) {
  std::vector<pdo::RemoteNode> out;
  for (const NodeConfig& node : config.nodes) {
    if (auto pdos = pdo::describe_pdos(node.device, longest_pdo(config)); pdos.ok()) {
      out.push_back({.id = node.id,
                     .name = node.name,
                     .pdos = *std::move(pdos.value),
                     .device = &node.device});
    }
  }
  return out;
}

bool has_sync(const LineConfig& config) {
  return config.sync_period > Duration::zero() || has_own_value(config, od::objects::kSyncPeriod) ||
         std::ranges::any_of(config.nodes, produces_sync);
}

}  // namespace

std::vector<Diagnostic> check_pdos(const LineConfig& config,
                                   std::span<const pdo::RemoteNode> remotes) {
  std::vector<Diagnostic> out;
  const IdentifierUsers services = services_of(config);
  for_each_pdo(remotes, [&](const pdo::RemoteNode& node, std::string_view kind,
                            const pdo::Parameters& each) {
    if (config.canopen_fd) {
      check_for_fd(node, kind, each, out);
    }
    if (const auto taken = services.find(identifier(each.cob_id)); taken != services.end()) {
      const IdentifierUser& user = taken->second;
      out.push_back({.severity = user.certain ? severity_in(config) : Severity::warning,
                     .file = node.device->file,
                     .text = text_of(node, kind, each) + " has the COB-ID of " + user.name +
                             (user.certain ? "" : ", if it sends any")});
    }
  });
  return out;
}

std::vector<Diagnostic> check_connection_pool(const LineConfig& config,
                                              std::span<const pdo::RemoteNode> remotes) {
  const manager::ConnectionPool& pool = config.connection_pool;
  std::vector<Diagnostic> out;
  const auto report = [&](std::string text) {
    out.push_back({.severity = Severity::error,
                   .file = config.name,
                   .text = "sdo_connections: " + std::move(text)});
  };
  if (pool == manager::ConnectionPool{}) {
    return out;
  }
  if (pool.pairs() == 0) {
    report("a connection takes two CAN-IDs, last is to be greater than first");
  }
  constexpr std::uint16_t kHighestId = 0x7FF;
  if (pool.last > kHighestId) {
    report(hex_text(pool.last, 3) + " has more than 11 bits");
    return out;
  }
  IdentifierUsers users = users_of(config, remotes);
  add_sleep(config, users);
  for (std::uint32_t id = pool.first; id <= pool.last; ++id) {
    if (can::is_restricted(id)) {
      report(hex_text(id, 3) + " is restricted (CiA 301 7.3.5)");
      return out;
    }
    if (const auto taken = users.find(id); taken != users.end()) {
      report(hex_text(id, 3) + " is that of " + taken->second.name);
    }
  }
  return out;
}

std::vector<Diagnostic> check_sleep_identifiers(const LineConfig& config,
                                                std::span<const pdo::RemoteNode> remotes) {
  std::vector<Diagnostic> out;
  if (!config.sleep.exists()) {
    return out;
  }
  IdentifierUsers users = users_of(config, remotes);
  users.emplace(can::kTimeId, IdentifierUser{"TIME"});
  for (const srdo::Source& srdo : srdo_sources(config)) {
    const IdentifierUser user{"SRDO " + std::to_string(srdo.number) + " of node " +
                              std::to_string(srdo.node)};
    users.emplace(srdo.cob_id, user);
    users.emplace(srdo.inverted_cob_id, user);
  }
  for (const std::uint32_t id : {config.sleep.request, config.sleep.objection}) {
    if (const auto taken = users.find(id); taken != users.end()) {
      out.push_back({.severity = Severity::error,
                     .file = config.name,
                     .text = "sleep: " + hex_text(id, 3) + " is that of " + taken->second.name});
    }
  }
  return out;
}

std::optional<Diagnostic> unsynchronised_pdos(const LineConfig& config) {
  if (config.role != Role::manager || has_sync(config)) {
    return std::nullopt;
  }
  constexpr std::size_t kMostNamed = 6;
  std::size_t waiting = 0;
  std::string names;
  for_each_pdo(remotes_of(config), [&](const pdo::RemoteNode& node, std::string_view kind,
                                       const pdo::Parameters& each) {
    if (pdo::is_synchronous(each.type) && ++waiting <= kMostNamed) {
      names += (names.empty() ? "" : ", ") + text_of(node, kind, each);
    }
  });
  if (waiting == 0) {
    return std::nullopt;
  }
  if (waiting > kMostNamed) {
    names += " and " + std::to_string(waiting - kMostNamed) + " more";
  }
  return Diagnostic{.severity = Severity::warning,
                    .file = config.name,
                    .text = names + ": on SYNC, but no node produces SYNC (sync of the line)"};
}

}  // namespace linegate::line
