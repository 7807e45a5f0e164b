// SPDX-License-Identifier: Apache-2.0
// to_json(): the configuration as JSON, for programs.
#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "gateway/config/value.h"
#include "gateway/publish/routing_text.h"
#include "gateway/tools/check.h"
#include "gateway/tools/check_parts.h"
#include "gateway/tools/json_text.h"
#include "stack/line/build.h"
#include "stack/line/line.h"
#include "stack/pdo/parameters.h"

namespace linegate::gateway {
namespace {

template <class Range, class Member>
Json array_of(const Range& range, const Member& member) {
  Json out = Json::array();
  for (const auto& one : range) {
    out.push_back(member(one));
  }
  return out;
}

Json diagnostic_json(const Diagnostic& diagnostic) {
  constexpr std::array<const char*, 3> kSeverities{"note", "warning", "error"};
  return {{"severity", kSeverities[static_cast<std::size_t>(diagnostic.severity)]},
          {"file", diagnostic.file},
          {"line", diagnostic.line},
          {"column", diagnostic.column},
          {"text", diagnostic.text}};
}

Json route_json(const routing::Route& route, const InterfaceNames& names,
                std::span<const routing::Interface> ways) {
  if (const auto way = routing::find_way(ways, route.interface)) {
    return {{"first", route.first}, {"last", route.last},
            {"line", ""},           {"node", 0},
            {"cost", route.cost},   {"gateway", way->to.gateway + '/' + way->to.line},
            {"enter", way->enter},  {"timeout_ns", way->timeout.count()}};
  }
  const auto line = std::find_if(names.begin(), names.end(),
                                 [&](const auto& name) { return name.first == route.interface; });
  return {{"first", route.first},
          {"last", route.last},
          {"line", line == names.end() ? std::string() : line->second},
          {"node", route.gateway},
          {"cost", route.cost}};
}

Json binding_json(const config::Binding& binding) {
  return {{"from", binding.from},
          {"input", binding.input_name},
          {"to", binding.to},
          {"output", binding.output_name},
          {"when_lost", line::name(binding.when_lost)},
          {"forwarded", binding.forwarded},
          {"object", binding.object ? config::format_address(*binding.object) : ""}};
}

Json remote_json(const std::string& line, const config::RemoteInput& input) {
  Json reactions = Json::array();
  for (const std::string_view word : config::reaction_words(input.reactions)) {
    reactions.push_back(word);
  }
  return {{"gateway", input.from.gateway},
          {"from", input.from.line},
          {"input", input.entry},
          {"to", line},
          {"output", input.output_name},
          {"group", input.group},
          {"timeout_ns", input.timeout.count()},
          {"when_lost", reactions}};
}

Json remote_inputs_json(const config::Plant& plant) {
  Json out = Json::array();
  for (const config::LinePlan& line : plant.lines) {
    for (const config::RemoteInput& input : line.remote_inputs) {
      out.push_back(remote_json(line.config.name, input));
    }
  }
  return out;
}

Json pdo_json(const pdo::Parameters& pdo) {
  return {{"number", pdo.number},
          {"cob_id", pdo.cob_id.id()},
          {"type", pdo.type},
          {"inhibit_ns", pdo.inhibit.count()},
          {"event_timer_ns", pdo.event_timer.count()},
          {"mapping", array_of(pdo.mapping, [](const auto& mapped) -> Json {
             return {{"index", mapped.address.index},
                     {"sub", mapped.address.sub},
                     {"bits", mapped.bits}};
           })}};
}

void add_pdos(const od::DeviceDescription& device, Json& to, std::size_t longest = 64) {
  const auto described = pdo::describe_pdos(device, longest);
  to["tpdos"] = described.value ? array_of(described.value->tpdos, pdo_json) : Json::array();
  to["rpdos"] = described.value ? array_of(described.value->rpdos, pdo_json) : Json::array();
}

// The values in the order of their bytes on the bus; an observer writes none.
void add_writes(const line::NodeConfig& node, line::Role role, Json& to) {
  Json writes = Json::array();
  const auto add = [&writes](od::Address address, std::span<const std::byte> data, bool by_dcf) {
    std::string digits;
    for (const std::byte byte : data) {
      digits += fmt::format("{:02X}", std::to_integer<unsigned>(byte));
    }
    writes.push_back(
        {{"object", config::format_address(address)}, {"data", digits}, {"dcf", by_dcf}});
  };
  if (role != line::Role::observer) {
    for (const manager::ObjectWrite& write : writes_of_file(node)) {
      add(write.address, write.data, true);
    }
    for (const line::ObjectValue& value : node.objects) {
      add(value.address, value.data, false);
    }
  }
  to["writes"] = std::move(writes);
}

// observed: another master boots the node, so the settings of its boot process have no effect.
Json node_json(const line::NodeConfig& node, line::Role role, std::size_t longest) {
  Json out{{"id", node.id},
           {"observed", role != line::Role::manager},
           {"name", node.name},
           {"file", node.device.file},
           {"product", node.device.product_name},
           {"mandatory", node.mandatory},
           {"boot", node.boot},
           {"keep_alive", node.keep_alive},
           {"boot_timeout_ns", node.boot_timeout.count()},
           {"reset_time_ns", node.reset_time.count()},
           {"sdo_timeout_ns", node.sdo_timeout.count()},
           {"sdo_block_from", node.block_from == sdo::kNoBlocks ? 0U : node.block_from},
           {"heartbeat_ns", node.heartbeat.count()}};
  add_writes(node, role, out);
  add_pdos(node.device, out, longest);
  return out;
}

Json device_json(const line::DeviceConfig& device) {
  Json out{{"id", device.id},
           {"name", device.name},
           {"file", device.device.file},
           {"product", device.device.product_name}};
  add_pdos(device.device, out);
  return out;
}

template <class T>
Json value_or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json entry_json(const image::Entry& entry) {
  return {{"name", entry.name},
          {"bit_offset", entry.bit_offset},
          {"bit_length", entry.bit_length},
          {"type", od::name(entry.type)},
          {"node", entry.node},
          {"index", entry.index},
          {"sub", entry.sub},
          {"remote_pdo", entry.remote_pdo},
          {"local_pdo", entry.local_pdo},
          {"variable_index", entry.variable_index},
          {"variable_sub", entry.variable_sub},
          {"unit", entry.scaling.unit},
          {"scale", entry.scaling.scale},
          {"offset", entry.scaling.offset},
          {"low", value_or_null(entry.low)},
          {"high", value_or_null(entry.high)},
          {"initial", value_or_null(entry.initial)},
          {"group", value_or_null(entry.group)}};
}

void add_layout(const image::Layout& layout, Json& to) {
  to[std::string(name(layout.direction)) + "_layout"] = {
      {"id", hex64(layout.id)},
      {"bytes", layout.byte_size},
      {"entries", array_of(layout.entries, entry_json)}};
}

Json group_json(const line::OutputGroup& group, const config::NamedTopics& named,
                const image::Layout& outputs) {
  return {{"number", group.number},
          {"name", group.name},
          {"send", group.send_always ? "always" : "on_change"},
          {"written_by", group.forwarded                 ? "forward"
                         : named.has_group(group.number) ? "named"
                                                         : "output_write"},
          {"entries", array_of(group.entries, [&](const auto entry) -> Json {
             return outputs.entries[entry].name;
           })}};
}

Json alias_json(const named::Alias& alias) {
  return {{"direction", image::name(alias.direction)},
          {"entry", alias.entry},
          {"identifier", alias.identifier}};
}

Json history_json(const config::History::Entry& entry) {
  return {{"direction", image::name(entry.direction)}, {"entry", entry.name}};
}

Json clients_json(const config::LinePlan& plan) {
  Json out = Json::object();
  for (const auto& [client, access] : plan.clients) {
    out[client] = {{"commands", config::name(access.commands)},
                   {"outputs", config::name(access.outputs)}};
  }
  return out;
}

Json flying_master_json(const line::LineConfig& line) {
  if (!line.flying_master) {
    return nullptr;
  }
  const nmt::FlyingMasterTimes times = line::flying_master_times(line);
  return {{"priority", times.priority},
          {"master_timeout_ns", times.master_timeout.count()},
          {"negotiation_delay_ns", times.negotiation_delay.count()},
          {"priority_slot_ns", times.priority_slot.count()},
          {"device_slot_ns", times.device_slot.count()},
          {"detect_cycle_ns", times.detect_cycle.count()},
          {"master_heartbeat_ns", line.flying_master->master_heartbeat.count()},
          {"detection", line.flying_master->forces_each_cycle ? "force" : "ask"}};
}

Json settings_json(const config::LinePlan& plan, const line::LineConfig& line) {
  return {{"name", line.name},
          {"interface", plan.interface.uri},
          {"role", name(plan.config.role)},
          {"role_at_start", name(line.role)},
          {"node_id", line.node_id},
          {"network_id", line.network_id},
          {"bit_rate", line.bit_rate},
          {"canopen_fd", line.canopen_fd},
          {"data_bit_rate", line.data_bit_rate},
          {"usdo_abort", usdo::name(line.usdo_abort)},
          {"emcy_fd", line.emcy_fd},
          {"heartbeat_ns", line.heartbeat.count()},
          {"sync_ns", line.sync_period.count()},
          {"emcy_bytes", node::name(line.error_scheme)},
          {"commands", config::name(plan.commands)},
          {"outputs", config::name(plan.outputs)},
          {"clients", clients_json(plan)},
          {"publish", config::name(plan.publish.rule)},
          {"publish_ns", plan.publish.time.count()},
          {"pdo_min_period_ns", plan.pdo_min_period.count()},
          {"request_share_permille", line.request_share},
          {"client_share_permille", line.client_share},
          {"sdo_connections", line.connection_pool.pairs()},
          {"start_nodes", line.start_nodes},
          {"start_all", line.start_all},
          {"own_start", line.own_start},
          {"on_error", lost_text(line.on_error)},
          {"boot_time_ns", line.boot_time.count()},
          {"nmt_inhibit_ns", line.nmt_inhibit.count()},
          {"flying_master", flying_master_json(line)},
          {"executor", plan.executor},
          {"storage", plan.storage},
          {"named", plan.named.published},
          {"named_ros2", plan.named.ros2},
          {"named_type_information", plan.named.type_information},
          {"named_min_separation_ns", plan.named.min_separation.count()},
          {"aliases", array_of(plan.named.aliases, alias_json)},
          {"history", array_of(plan.history.entries, history_json)},
          {"history_min_interval_ns", plan.history.min_interval.count()}};
}

Json line_json(const config::LinePlan& plan) {
  const line::LineConfig line = as_started(plan.config);
  Json out = settings_json(plan, line);
  out["enter"] = array_of(line.routing.access, [](const auto& rule) -> Json {
    return {{"first", rule.first}, {"last", rule.last}, {"services", services_text(rule)}};
  });
  out["nodes"] = array_of(line.nodes, [&](const auto& node) {
    return node_json(node, line.role, line::longest_pdo(line));
  });
  out["devices"] = array_of(line.devices, device_json);
  if (const auto made = line::Line::make(line); made.value) {
    const auto& outputs = (*made.value)->layout(image::Direction::outputs);
    add_layout((*made.value)->layout(image::Direction::inputs), out);
    add_layout(outputs, out);
    out["groups"] = array_of(
        line.groups, [&](const auto& group) { return group_json(group, plan.named, outputs); });
  }
  return out;
}

Json journal_json(const config::Journal& journal) {
  return {{"file", journal.file},
          {"max_size", journal.max_size},
          {"values_size", journal.values_size},
          {"max_age_s", std::chrono::floor<std::chrono::seconds>(journal.max_age).count()}};
}

void add_plant(const config::Plant& plant, Json& to) {
  to["gateway"] = plant.gateway;
  to["dds_domain"] = plant.dds_domain;
  to["dds_profile"] = plant.dds_profile;
  to["dds_interfaces"] = plant.dds_interfaces;
  to["dds_peers"] = plant.dds_peers;
  to["dds_discovery_servers"] = plant.dds_servers;
  to["dds_fan_out"] = plant.dds_multicast ? "multicast" : "unicast";
  to["dds_security"] = plant.dds_security;
  to["dds_routes_security"] = plant.dds_routes_security;
  to["dds_guard"] = plant.dds_guard;
  to["dds_partitions"] = plant.dds_partitions;
  to["dds_process"] = plant.dds_own_process ? "own" : "same";
  to["log"] = config::name(plant.log);
  to["journal"] = plant.journal ? journal_json(*plant.journal) : Json();
  const InterfaceNames names = interface_names(plant);
  const std::vector<routing::Interface> ways = ways_of(plant);
  to["routes"] =
      array_of(routes_of(plant), [&](const auto& route) { return route_json(route, names, ways); });
  to["lines"] = array_of(plant.lines, line_json);
  to["bindings"] = array_of(plant.bindings, binding_json);
  to["remote_inputs"] = remote_inputs_json(plant);
}

}  // namespace

std::string to_json(const Loaded<config::Plant>& loaded) {
  Json out{{"ok", loaded.ok()}, {"diagnostics", array_of(loaded.diagnostics, diagnostic_json)}};
  if (loaded.value) {
    add_plant(*loaded.value, out);
  }
  return json_text(out);
}

}  // namespace linegate::gateway
