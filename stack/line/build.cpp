// SPDX-License-Identifier: Apache-2.0
#include "stack/line/build.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/image/scaling.h"
#include "stack/line/own_objects.h"
#include "stack/line/pdo_checks.h"
#include "stack/line/srdo_plan.h"
#include "stack/manager/network_list.h"
#include "stack/nmt/flying_master.h"
#include "stack/od/objects.h"
#include "stack/srdo/configuration.h"

namespace linegate::line {
namespace {

bool is_node_id(unsigned id) {
  return id >= can::kMinNodeId && id <= can::kMaxNodeId;
}

Diagnostic error(const LineConfig& config, std::string text) {
  return {.severity = Severity::error, .file = config.name, .text = std::move(text)};
}

std::string node_text(const NodeConfig& node) {
  return "node " + std::to_string(node.id) + (node.name.empty() ? "" : " (" + node.name + ")");
}

std::uint32_t described(const od::DeviceDescription& device, od::Address address) {
  const od::VariableDescription* variable = device.find(address);
  if (variable == nullptr || variable->value.size() > 4) {
    return 0;
  }
  return static_cast<std::uint32_t>(load_le(std::span<const std::byte>(variable->value)));
}

std::vector<std::byte> milliseconds_u16(Duration duration) {
  std::vector<std::byte> out(2);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(duration).count();
  store_le(std::span(out), static_cast<std::uint64_t>(ms));
  return out;
}

void expect_identity(const NodeConfig& node, manager::NodePlan& plan) {
  const auto expected = [&](bool compared, od::Address address) {
    return compared ? described(node.device, address) : 0;
  };
  plan.device_type = expected(node.check.device_type, {od::objects::kDeviceType, 0});
  plan.vendor = expected(node.check.vendor, od::objects::kVendorId);
  plan.product = expected(node.check.product, od::objects::kProductCode);
  plan.revision = expected(node.check.revision, od::objects::kRevisionNumber);
  plan.revision_major_alone = node.check.revision_major_alone;
}

}  // namespace

// 2.5 producer times, so that the loss of one heartbeat does not count as the loss of the node.
Duration consumer_time(const NodeConfig& node) {
  return node.heartbeat_consumer != Duration::zero() ? node.heartbeat_consumer
                                                     : node.heartbeat * 5 / 2;
}

namespace {

// A heartbeat takes precedence over node guarding, so the heartbeat of a device that produces one
// by default is switched off.
void guard(const NodeConfig& node, manager::NodePlan& plan) {
  if (node.guard_time == Duration::zero()) {
    return;
  }
  plan.guard_time = node.guard_time;
  plan.life_time_factor = node.life_time_factor;
  if (described(node.device, {od::objects::kProducerHeartbeatTime, 0}) != 0) {
    plan.writes.push_back(
        {{od::objects::kProducerHeartbeatTime, 0}, milliseconds_u16(Duration::zero())});
  }
  plan.writes.push_back({{od::objects::kGuardTime, 0}, milliseconds_u16(node.guard_time)});
  plan.writes.push_back({{od::objects::kLifeTimeFactor, 0}, {std::byte{node.life_time_factor}}});
}

manager::NodePlan node_plan(const NodeConfig& node, std::size_t longest) {
  manager::NodePlan plan;
  plan.id = node.id;
  plan.boot = node.boot;
  plan.mandatory = node.mandatory;
  plan.keep_alive = node.keep_alive;
  expect_identity(node, plan);
  plan.serial = node.serial.value_or(0);
  plan.heartbeat_consumer = consumer_time(node);
  plan.boot_timeout = node.boot_timeout;
  plan.reset_time = node.reset_time;
  plan.sdo_timeout = node.sdo_timeout;
  plan.pdos = manager::assumed_pdos(node.device, !node.as_found, longest);
  std::ranges::move(assumed_srdos(node), std::back_inserter(plan.pdos));
  if (node.as_found) {
    plan.guard_time = node.guard_time;
    plan.life_time_factor = node.life_time_factor;
    return plan;
  }
  plan.writes = manager::configuration_writes(node.device);
  for (const ObjectValue& object : node.objects) {
    plan.writes.push_back({object.address, object.data});
  }
  srdo::order_writes(node.device, plan.writes);  // before error control, which begins last
  if (node.heartbeat != Duration::zero()) {
    plan.writes.push_back(
        {{od::objects::kProducerHeartbeatTime, 0}, milliseconds_u16(node.heartbeat)});
  }
  guard(node, plan);
  manager::date_last(plan.writes);
  plan.restore = node.restore;
  plan.store = node.store;
  plan.software = node.software;
  plan.update_software = node.update_software;
  plan.program = node.program;
  plan.expected = manager::date_of(plan.writes);
  if (plan.store != 0 && !plan.expected.known()) {
    plan.expected = manager::fingerprint_of(plan.writes, plan.pdos);
  }
  return plan;
}

void check_node(const LineConfig& config, const NodeConfig& node, std::vector<Diagnostic>& out) {
  constexpr Duration kMaxHeartbeat = std::chrono::milliseconds(0xFFFF);
  if (!is_node_id(node.id)) {
    out.push_back(error(config, "node-ID " + std::to_string(node.id) + " is not in 1..127"));
  }
  if (node.id == config.node_id) {
    out.push_back(error(config, node_text(node) + " has the node-ID of the line's own node"));
  }
  if (node.heartbeat < Duration::zero() || node.heartbeat > kMaxHeartbeat) {
    out.push_back(error(config, node_text(node) + ": heartbeat is not in 0..65535 ms"));
  }
  if (node.heartbeat_consumer < Duration::zero()) {
    out.push_back(error(config, node_text(node) + ": heartbeat consumer time is negative"));
  }
  if (node.guard_time < Duration::zero() || node.guard_time > kMaxHeartbeat) {
    out.push_back(error(config, node_text(node) + ": guard time is not in 0..65535 ms"));
  }
  if ((node.guard_time != Duration::zero()) != (node.life_time_factor != 0)) {
    out.push_back(error(config, node_text(node) + ": guarding needs both time and factor"));
  }
  if (node.guard_time != Duration::zero() &&
      (node.heartbeat != Duration::zero() || node.heartbeat_consumer != Duration::zero())) {
    out.push_back(error(config, node_text(node) + ": either a heartbeat or guarding"));
  }
}

// What CANopen FD does not have, or what no public text defines for it.
void check_fd(const LineConfig& config, std::vector<Diagnostic>& out) {
  if (!config.canopen_fd && config.emcy_fd) {
    out.push_back(error(config, "emcy_fd is for lines of CANopen FD"));
  }
  if (!config.canopen_fd) {
    return;
  }
  const auto has_gateway = [&](const routing::Route& route) {
    return config.routing.interface != 0 && route.interface == config.routing.interface &&
           route.gateway != 0;
  };
  if (std::ranges::any_of(config.routing.routes, has_gateway)) {
    out.push_back(
        error(config, "remote USDO is not defined: a line of CANopen FD reaches no next gateway"));
  }
  const bool has_slaves = std::ranges::any_of(config.devices, &DeviceConfig::lss);
  if (config.lss.assign || has_slaves) {
    out.push_back(error(config, "LSS is not defined for CANopen FD"));
  }
  if (config.sleep.exists()) {
    out.push_back(error(config, "sleep is not defined for CANopen FD: leave out sleep"));
  }
  if (config.connection_pool.first != 0) {
    out.push_back(
        error(config, "SDO connections are not defined for CANopen FD: leave out sdo_connections"));
  }
  for (const ObjectValue& value : config.own_values) {
    const bool manager =
        (load_le(std::span<const std::byte>(value.data)) & manager::startup::kMaster) != 0;
    if (value.address == od::Address{od::objects::kNmtStartup, 0} &&
        manager != (config.role == Role::manager)) {
      out.push_back(error(config, std::string("1F80h bit 0 is ") + (manager ? '1' : '0') +
                                      ": a line of CANopen FD keeps its role"));
    }
  }
  const auto is_mpdo = [](const pdo::Parameters& pdo) { return pdo.mpdo != pdo::MpdoMode::none; };
  if (!config.mpdo_scanner.empty() || !config.mpdo_dispatcher.empty() ||
      std::ranges::any_of(config.forwarding.tpdos, is_mpdo) ||
      std::ranges::any_of(config.forwarding.rpdos, is_mpdo)) {
    out.push_back(error(config, "MPDO is not defined for CANopen FD"));
  }
  for (const NodeConfig& node : config.nodes) {
    if (node.guard_time != Duration::zero()) {
      out.push_back(error(config, node_text(node) + ": CANopen FD has no node guarding"));
    }
    if (!transmitted_srdos(node).empty()) {
      out.push_back(error(config, node_text(node) + ": SRDO is not defined for CANopen FD"));
    }
  }
}

void check_devices(const LineConfig& config, std::vector<Diagnostic>& out) {
  if (config.devices.empty()) {
    return;
  }
  if (config.role != Role::device || !config.nodes.empty()) {
    out.push_back(error(config, "own devices are for the role device, which has no nodes"));
  }
  std::set<std::uint8_t> seen;
  for (const DeviceConfig& device : config.devices) {
    const std::string id = std::to_string(device.id);
    if (!is_node_id(device.id)) {
      out.push_back(error(config, "node-ID " + id + " of a device is not in 1..127"));
    }
    if (!seen.insert(device.id).second) {
      out.push_back(error(config, "two devices have the node-ID " + id));
    }
  }
}

bool same_interface(const routing::Config& routing, const LineConfig& config) {
  return std::any_of(routing.interfaces.begin(), routing.interfaces.end(),
                     [&](const routing::Interface& line) {
                       return line.number == routing.interface && line.network == config.network_id;
                     });
}

void check_routing(const LineConfig& config, std::vector<Diagnostic>& out) {
  const routing::Config& routing = config.routing;
  if (routing.interface == 0) {
    if (!routing.routes.empty()) {
      out.push_back(error(config, "routes, but the line has no interface number"));
    }
    return;
  }
  if (!same_interface(routing, config)) {
    out.push_back(error(
        config, "interface " + std::to_string(routing.interface) + " is not that of this network"));
  }
  if (routing.routes.size() > routing::kMaxRoutes) {
    out.push_back(error(config, "more than 254 routes"));
  }
  for (const routing::RouteFinding& found : routing::check(routing.routes, routing.interfaces)) {
    std::string text = "routing table, entry " + std::to_string(found.entry + 1) + ": " +
                       std::string(routing::describe(found.fault));
    if (found.fault == routing::RouteFault::overlap) {
      text += " (entry " + std::to_string(found.other + 1) + ')';
    }
    out.push_back(error(config, std::move(text)));
  }
  for (const routing::AccessRule& rule : routing.access) {
    if (rule.first == 0 || rule.last < rule.first) {
      out.push_back(error(config, "routing access: networks " + std::to_string(rule.first) +
                                      " to " + std::to_string(rule.last) + " are none"));
    }
  }
}

void check_flying_master(const LineConfig& config, std::vector<Diagnostic>& out) {
  if (!config.flying_master) {
    return;
  }
  const FlyingMasterConfig& flying = *config.flying_master;
  if (config.role != Role::manager) {
    out.push_back(error(config, "a flying master has the role manager"));
  }
  if (flying.priority > nmt::kLowestMasterPriority) {
    out.push_back(error(config, "the priority of the flying master is not in 0..2"));
  }
  const auto is_time = [](Duration time) {
    return time > Duration::zero() && time <= std::chrono::milliseconds(0xFFFF);
  };
  const bool optional_times_are_good =
      (flying.detect_cycle == Duration::zero() || is_time(flying.detect_cycle)) &&
      (flying.master_heartbeat == Duration::zero() || is_time(flying.master_heartbeat));
  if (!is_time(flying.master_timeout) || !is_time(flying.negotiation_delay) ||
      !is_time(flying.priority_slot) || !is_time(flying.device_slot) || !optional_times_are_good) {
    out.push_back(error(config, "a time of the flying master is not in 1..65535 ms"));
  } else if (flying.priority_slot <= can::kMaxNodeId * flying.device_slot) {
    out.push_back(
        error(config, "priority_slot of the flying master is not above 127 device slots"));
  }
}

void check_sleep(const LineConfig& config, std::vector<Diagnostic>& out) {
  const nmt::SleepProtocol& sleep = config.sleep;
  if (!sleep.exists() && sleep.objection == 0) {
    return;
  }
  const auto is_free = [](std::uint32_t id) { return id <= 0x7FF && !can::is_restricted(id); };
  if (!is_free(sleep.request) || !is_free(sleep.objection) || sleep.request == sleep.objection) {
    out.push_back(error(config, "sleep needs two identifiers that no other service uses"));
  }
  const std::set<std::uint8_t> codes{sleep.check_byte, sleep.prepare_byte, sleep.wake_byte};
  if (codes.size() != 3) {
    out.push_back(error(config, "two requests of sleep have the same byte"));
  }
  const Duration shortest = std::min({sleep.check_time, sleep.prepare_time, sleep.silent_time});
  if (shortest <= Duration::zero()) {
    out.push_back(error(config, "the times of sleep are longer than 0"));
  }
  if (!config.devices.empty()) {
    out.push_back(error(config, "sleep is for a line with one own node, or an observer"));
  }
  if (config.flying_master) {
    out.push_back(error(config, "sleep is not defined for a flying master: leave out one of them"));
  }
}

bool is_share(std::uint16_t permille) {
  return permille >= 1 && permille <= 1000;
}

}  // namespace

std::vector<Diagnostic> check(const LineConfig& config) {
  std::vector<Diagnostic> out;
  const bool needs_no_node_id =
      (config.role == Role::observer && config.node_id == 0) || !config.devices.empty();
  if (!needs_no_node_id && !is_node_id(config.node_id)) {
    out.push_back(
        error(config, "own node-ID " + std::to_string(config.node_id) + " is not in 1..127"));
  }
  if (config.network_id < 1 || config.network_id > 127) {
    out.push_back(
        error(config, "network-ID " + std::to_string(config.network_id) + " is not in 1..127"));
  }
  if (!is_share(config.request_share) || !is_share(config.client_share)) {
    out.push_back(error(config, "a share of the bit rate is not in 1..1000 thousandths"));
  }
  std::set<std::uint8_t> seen;
  for (const NodeConfig& node : config.nodes) {
    check_node(config, node, out);
    if (!seen.insert(node.id).second) {
      out.push_back(error(config, "node-ID " + std::to_string(node.id) + " is configured twice"));
    }
  }
  if (!diagnosis::is_free_for_records(config.canopen_ia_base)) {
    out.push_back(error(config, "the CANopenIA records have no room at their base"));
  }
  check_fd(config, out);
  check_devices(config, out);
  check_flying_master(config, out);
  const std::vector<Diagnostic> objects = check_own_objects(config);
  out.insert(out.end(), objects.begin(), objects.end());
  check_routing(config, out);
  check_sleep(config, out);
  return out;
}

manager::Options manager_options(const LineConfig& config) {
  const bool manages = config.role == Role::manager;
  const bool as_found = std::ranges::any_of(config.nodes, &NodeConfig::as_found);
  return {.reset_nodes = config.reset_nodes && !as_found,
          .sdo_timeout = config.sdo_timeout,
          .master = manages,
          .flying = config.flying_master.has_value(),
          .start_all = config.start_all,
          .own_start = config.own_start,
          .start_nodes = config.start_nodes,
          .on_error = config.on_error,
          .boot_time = config.boot_time,
          .nmt_inhibit = config.nmt_inhibit};
}

nmt::FlyingMasterTimes flying_master_times(const LineConfig& config) {
  const FlyingMasterConfig& from = config.flying_master.value();
  const Duration cycle = std::chrono::milliseconds(4000 + 10 * config.node_id);
  return {.master_timeout = from.master_timeout,
          .negotiation_delay = from.negotiation_delay,
          .priority = from.priority,
          .priority_slot = from.priority_slot,
          .device_slot = from.device_slot,
          .detect_cycle = from.detect_cycle != Duration::zero() ? from.detect_cycle : cycle};
}

std::vector<manager::NodePlan> node_plans(const LineConfig& config) {
  std::vector<manager::NodePlan> plans;
  plans.reserve(config.nodes.size());
  std::vector<const od::DeviceDescription*> devices;
  std::vector<bool> correct;
  for (const NodeConfig& node : config.nodes) {
    plans.push_back(node_plan(node, longest_pdo(config)));
    devices.push_back(&node.device);
    correct.push_back(!node.as_found);
  }
  manager::add_other_pdos(devices, correct, plans, longest_pdo(config));
  return plans;
}

can::CobId emcy_cob_id(const NodeConfig& node) {
  constexpr od::Address kEmcyCobId{od::objects::kEmcyCobId, 0};
  can::CobId cob_id{can::kEmcyBase + node.id};
  const auto take = [&cob_id](const std::vector<std::byte>& value) {
    if (value.size() != sizeof cob_id.raw) {
      return;
    }
    const can::CobId said{load_le<std::uint32_t>(value.data())};
    if (!said.valid() || can::is_usable(said)) {
      cob_id = said;
    }
  };
  if (const od::VariableDescription* described = node.device.find(kEmcyCobId)) {
    take(described->value);
  }
  for (const ObjectValue& object : node.objects) {
    if (object.address == kEmcyCobId) {
      take(object.data);
    }
  }
  return cob_id;
}

// An RPDO has no inhibit time (CiA 301): a value in the device file is ignored.
void set_inhibit_times(const NodeConfig& node, pdo::DevicePdos& pdos) {
  for (pdo::Parameters& rpdo : pdos.rpdos) {
    const auto known = node.rpdo_inhibit.find(rpdo.number);
    rpdo.inhibit = known == node.rpdo_inhibit.end() ? Duration{} : known->second;
  }
}

Loaded<pdo::LinkPlan> link_plan(const LineConfig& config) {
  std::vector<Diagnostic> diagnostics;
  std::vector<pdo::RemoteNode> remotes;
  for (const NodeConfig& node : config.nodes) {
    Loaded<pdo::DevicePdos> pdos = pdo::describe_pdos(node.device, longest_pdo(config));
    diagnostics.insert(diagnostics.end(), pdos.diagnostics.begin(), pdos.diagnostics.end());
    if (pdos.ok()) {
      set_inhibit_times(node, *pdos.value);
      remotes.push_back({.id = node.id,
                         .name = node.name,
                         .pdos = *std::move(pdos.value),
                         .device = &node.device,
                         .deadline = node.pdo_deadline,
                         .srdos = transmitted_srdos(node)});
    }
  }
  const std::vector<Diagnostic> of_srdos = check_srdos(config);
  diagnostics.insert(diagnostics.end(), of_srdos.begin(), of_srdos.end());
  const std::vector<Diagnostic> wrong = check_pdos(config, remotes);
  diagnostics.insert(diagnostics.end(), wrong.begin(), wrong.end());
  const std::vector<Diagnostic> pool = check_connection_pool(config, remotes);
  diagnostics.insert(diagnostics.end(), pool.begin(), pool.end());
  const std::vector<Diagnostic> asleep = check_sleep_identifiers(config, remotes);
  diagnostics.insert(diagnostics.end(), asleep.begin(), asleep.end());
  Loaded<pdo::LinkPlan> plan = pdo::plan_links(remotes);
  plan.diagnostics.insert(plan.diagnostics.begin(), diagnostics.begin(), diagnostics.end());
  if (has_errors(plan.diagnostics)) {
    plan.value.reset();
  }
  if (plan.value) {
    set_queues(config, *plan.value);
  }
  return plan;
}

std::vector<Diagnostic> check_outputs(const LineConfig& config, const image::Layout& outputs) {
  std::vector<Diagnostic> out;
  std::set<std::uint32_t> grouped;
  std::set<std::uint16_t> numbers;
  for (const OutputGroup& group : config.groups) {
    const std::string what = "output group " + std::to_string(group.number) + ": ";
    if (!numbers.insert(group.number).second) {
      out.push_back(error(config, what + "the number is used twice"));
    }
    for (const std::uint32_t entry : group.entries) {
      if (entry >= outputs.entries.size()) {
        out.push_back(error(config, what + "there is no output entry " + std::to_string(entry)));
      } else if (std::ranges::binary_search(config.bound, entry)) {
        out.push_back(error(config, what + outputs.entries[entry].name + " follows an input"));
      } else if (!grouped.insert(entry).second) {
        out.push_back(error(config, what + outputs.entries[entry].name + " is in two groups"));
      }
    }
  }
  for (const std::uint32_t entry : config.bound) {
    if (entry >= outputs.entries.size()) {
      out.push_back(error(config, "there is no output entry " + std::to_string(entry) +
                                      " that could follow an input"));
    }
  }
  for (const OutputDefault& value : config.defaults) {
    if (value.entry >= outputs.entries.size()) {
      out.push_back(error(config, "default for output entry " + std::to_string(value.entry) +
                                      ", which does not exist"));
    } else if (outputs.entries[value.entry].bit_length > 64) {
      out.push_back(
          error(config, outputs.entries[value.entry].name + " has no default: more than 64 bits"));
    }
  }
  return out;
}

void describe_outputs(const LineConfig& config, image::Layout& outputs) {
  for (const OutputGroup& group : config.groups) {
    for (const std::uint32_t entry : group.entries) {
      outputs.entries[entry].group = group.number;
    }
  }
  const bool has_groups = !std::ranges::all_of(config.groups, &OutputGroup::forwarded);
  for (std::uint32_t i = 0; i < outputs.entries.size() && !has_groups; ++i) {
    if (config.role != Role::observer && !std::ranges::binary_search(config.bound, i) &&
        !outputs.entries[i].group) {
      outputs.entries[i].group = 0;
    }
  }
  for (const OutputDefault& value : config.defaults) {
    image::Entry& entry = outputs.entries[value.entry];
    std::vector<std::byte> bytes((entry.bit_length + 7U) / 8U);
    store_le(std::span(bytes), value.value);
    entry.initial = entry.type == od::DataType::boolean
                        ? std::optional(static_cast<double>(value.value & 1U))
                        : image::scaled_number(entry, bytes);
    if (entry.initial && !std::isfinite(*entry.initial)) {
      entry.initial.reset();
    }
  }
}

diagnosis::Options diagnosis_options(const LineConfig& config) {
  diagnosis::Options out{.own_node = config.node_id};
  for (const NodeConfig& node : config.nodes) {
    out.assigned.set(node.id);
    out.mandatory.set(node.id, node.mandatory);
  }
  out.fatal_events =
      config.strict_ixxat ? diagnosis::kStrictlyFatalEvents : diagnosis::kFatalEvents;
  return out;
}

diagnosis::CanopenIaOptions canopen_ia_options(const LineConfig& config) {
  return {.base = config.canopen_ia_base,
          .own_node = config.node_id,
          .manager = config.role == Role::manager,
          .revision = config.identity.revision,
          .serial = config.identity.serial,
          .settings = {.keep_operational = config.keep_operational,
                       .heartbeat = config.found_heartbeat,
                       .update_time = config.pdo_update_time}};
}

}  // namespace linegate::line
