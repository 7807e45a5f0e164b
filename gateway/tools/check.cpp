// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/check.h"

#include <algorithm>
#include <ctime>
#include <iostream>
#include <iterator>
#include <memory>
#include <span>

#include <fmt/format.h>

#include "bridges/named/identifiers.h"
#include "bridges/named/ros2_types.h"
#include "gateway/config/hints.h"
#include "gateway/config/value.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/routing_text.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "gateway/tools/check_parts.h"
#include "stack/base/byte_order.h"
#include "stack/image/scaling.h"
#include "stack/line/build.h"
#include "stack/line/line.h"
#include "stack/manager/network_list.h"
#include "stack/manager/plan.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

namespace linegate::gateway {

std::string hex64(std::uint64_t value) {
  return fmt::format("{:016X}", value);
}

line::LineConfig as_started(line::LineConfig config) {
  namespace bits = manager::startup;
  constexpr od::Address kNmtStartup{od::objects::kNmtStartup, 0};
  const auto own = std::ranges::find(config.own_values, kNmtStartup, &line::ObjectValue::address);
  if (own == config.own_values.end() || config.role == line::Role::observer) {
    return config;
  }
  const std::uint64_t value = load_le(own->data);
  config.role = (value & bits::kMaster) != 0 ? line::Role::manager : line::Role::device;
  if (config.role != line::Role::manager || (value & bits::kFlyingMaster) == 0) {
    config.flying_master.reset();
  }
  config.own_start = (value & bits::kApplicationStarts) == 0;
  config.start_nodes = (value & bits::kSlavesNotStarted) == 0;
  config.start_all = (value & bits::kStartAll) != 0;
  config.on_error = (value & bits::kStopAll) != 0    ? manager::ErrorReaction::stop_all
                    : (value & bits::kResetAll) != 0 ? manager::ErrorReaction::reset_all
                                                     : manager::ErrorReaction::node;
  return config;
}

std::string_view lost_text(manager::ErrorReaction reaction) {
  switch (reaction) {
    case manager::ErrorReaction::reset_all:
      return "all reset when a mandatory node is lost";
    case manager::ErrorReaction::stop_all:
      return "all stopped when a mandatory node is lost";
    case manager::ErrorReaction::node:
      break;
  }
  return "a lost node is reset";
}

std::vector<manager::ObjectWrite> writes_of_file(const line::NodeConfig& node) {
  if (node.as_found) {
    return {};
  }
  std::vector<manager::ObjectWrite> out = manager::configuration_writes(node.device);
  std::erase_if(out, [](const manager::ObjectWrite& write) {
    return od::objects::is_pdo_record(write.address.index);
  });
  return out;
}

namespace {

const config::LinePlan* routing_line(const config::Plant& plant) {
  const auto at = std::ranges::find_if(
      plant.lines, [](const auto& line) { return line.config.routing.interface != 0; });
  return at == plant.lines.end() ? nullptr : &*at;
}

}  // namespace

std::vector<routing::Interface> ways_of(const config::Plant& plant) {
  std::vector<routing::Interface> out;
  if (const config::LinePlan* const line = routing_line(plant)) {
    std::ranges::copy_if(line->config.routing.interfaces, std::back_inserter(out),
                         [](const routing::Interface& each) { return each.way != nullptr; });
  }
  return out;
}

InterfaceNames interface_names(const config::Plant& plant) {
  InterfaceNames out;
  for (const auto& line : plant.lines) {
    out.emplace_back(line.config.routing.interface, line.config.name);
  }
  for (const routing::Interface& way : ways_of(plant)) {
    out.emplace_back(way.number, way.name);
  }
  return out;
}

std::vector<routing::Route> routes_of(const config::Plant& plant) {
  const config::LinePlan* const line = routing_line(plant);
  return line == nullptr ? std::vector<routing::Route>() : line->config.routing.routes;
}

namespace {

using config::format_duration;

std::string publish_text(const config::Publish& publish) {
  switch (publish.rule) {
    case config::Publish::Rule::on_change:
      return "on change, at most every " + format_duration(publish.time);
    case config::Publish::Rule::on_sync:
      return "on SYNC";
    case config::Publish::Rule::period:
      break;
  }
  return "every " + format_duration(publish.time);
}

std::string transmission(std::uint8_t type) {
  if (type == pdo::kSyncAcyclic) {
    return "on SYNC after a change";
  }
  if (pdo::is_synchronous(type)) {
    return type == 1 ? "every SYNC" : fmt::format("every {} SYNCs", type);
  }
  return pdo::is_event_driven(type) ? "on event" : fmt::format("type {}", type);
}

// The objects that the boot process compares. A 0 in the device file is never compared (CiA 302-2,
// 1F84h to 1F88h).
std::string scope_text(const line::NodeConfig& node) {
  const auto is_given = [&node](od::Address address) {
    const od::VariableDescription* const known = node.device.find(address);
    return known != nullptr && load_le(std::span<const std::byte>(known->value)) != 0;
  };
  const line::IdentityScope& scope = node.check;
  const std::pair<bool, const char*> parts[] = {
      {scope.device_type && is_given({od::objects::kDeviceType, 0}), "device type"},
      {scope.vendor && is_given(od::objects::kVendorId), "vendor"},
      {scope.product && is_given(od::objects::kProductCode), "product"},
      {scope.revision && is_given(od::objects::kRevisionNumber),
       scope.revision_major_alone ? "major revision" : "revision"}};
  std::string out;
  for (const auto& [compared, name] : parts) {
    if (compared) {
      out += (out.empty() ? "" : ", ") + std::string(name);
    }
  }
  return out.empty() ? "not checked" : "by " + out;
}

// Prefix of the settings of nodes that another master boots.
constexpr std::string_view kAsMaster = "only when bit 0 of 1F80h makes it the NMT master: ";

std::string off_or(Duration duration) {
  return duration == Duration::zero() ? "off" : format_duration(duration);
}

// A text in quotes, the octets of other strings and of a DOMAIN in their order on the bus, a number
// in hexadecimal.
std::string value_text(od::DataType type, std::span<const std::byte> value) {
  std::string out;
  if (type == od::DataType::visible_string) {
    for (const std::byte octet : value) {
      const char c = static_cast<char>(octet);
      out += c == '"' || c == '\\' ? std::string{'\\', c}
                                   : std::string(1, c >= ' ' && c <= '~' ? c : '.');
    }
    return '"' + out + '"';
  }
  if (od::is_string(type) || type == od::DataType::domain ||
      (type == od::DataType::none && value.size() > 8)) {
    for (const std::byte octet : value) {
      out += fmt::format("{}{:02X}", out.empty() ? "" : " ", std::to_integer<unsigned>(octet));
    }
    return value.empty() ? "empty" : out;
  }
  for (auto it = value.rbegin(); it != value.rend(); ++it) {
    out += fmt::format("{:02X}", std::to_integer<unsigned>(*it));
  }
  return out + 'h';
}

class Text {
 public:
  std::string take() { return std::move(out_); }

  void plant(const config::Plant& plant) {
    add("gateway {}, DDS domain {}, {}{}profile {}, log {}\n", plant.gateway, plant.dds_domain,
        plant.dds_own_process ? "DDS in a process of its own, " : "",
        plant.dds_guard ? "" : "DDS guard off: one datagram can stop this gateway, ",
        dds_profiles_in_use(plant.dds_profile), config::name(plant.log));
    if (!plant.dds_interfaces.empty())
      add("DDS on the interfaces {} alone\n", fmt::join(plant.dds_interfaces, ", "));
    if (!plant.dds_peers.empty())
      add("DDS peers beside multicast: {}\n", fmt::join(plant.dds_peers, ", "));
    if (!plant.dds_servers.empty())
      add("DDS discovery servers: {}\n", fmt::join(plant.dds_servers, ", "));
    if (plant.dds_multicast)
      add("process images by multicast to clients that ask for it\n");
    if (plant.dds_partitions)
      add("DDS partition of each line: {}/LINE\n", plant.gateway);
    if (!plant.dds_security.empty())
      add("DDS-Security with the identity in {}\n", plant.dds_security);
    if (!plant.dds_routes_security.empty())
      add("requests to other gateways with the identity in {}\n", plant.dds_routes_security);
    if (plant.journal) {
      add("journal {}: up to {}, {}; values up to {}\n", plant.journal->file,
          config::format_size(plant.journal->max_size),
          plant.journal->max_age == Duration::zero()
              ? "events of any age"
              : "events up to " + config::format_age(plant.journal->max_age),
          config::format_size(plant.journal->values_size));
    }
    for (const auto& e : plant.executors) {
      add("executor {}: priority {}, processor {}, memory {}\n", e.name, e.priority,
          e.processor ? std::to_string(*e.processor) : "any",
          e.lock_memory ? "locked" : "not locked");
    }
    routes(plant);
    for (const auto& line : plant.lines) {
      this->line(line);
    }
    const bool has_remote = std::ranges::any_of(
        plant.lines, [](const auto& line) { return !line.remote_inputs.empty(); });
    add("{}", plant.bindings.empty() && !has_remote ? "" : "\n");
    for (const auto& b : plant.bindings) {
      constexpr std::array<const char*, 3> kWhenLost{"held", "0", "not sent"};
      const auto lost = kWhenLost[static_cast<std::size_t>(b.when_lost)];
      if (b.forwarded) {
        add("forward {}/{} -> {}/{}{}, {} when that is lost\n", b.from, b.input_name, b.to,
            b.output_name, b.object ? " as " + config::format_address(*b.object) : "", lost);
      } else {
        add("{}/{} follows {}/{}, {} when that is lost\n", b.to, b.output_name, b.from,
            b.input_name, lost);
      }
    }
    for (const auto& line : plant.lines) {
      for (const config::RemoteInput& input : line.remote_inputs) {
        add("forward {} of another gateway -> {}/{} as output group {}, {} after {} without a "
            "valid "
            "value\n",
            input.source(), line.config.name, input.output_name, input.group,
            fmt::join(config::reaction_words(input.reactions), ", "),
            config::format_duration(input.timeout));
      }
    }
  }

 private:
  template <class... T>
  void add(fmt::format_string<T...> format, T&&... arguments) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<T>(arguments)...);
  }

  // Printed once, because all lines have the same routes.
  void routes(const config::Plant& plant) {
    const InterfaceNames names = interface_names(plant);
    const std::vector<routing::Interface> ways = ways_of(plant);
    for (const auto& route : routes_of(plant)) {
      if (const auto way = routing::find_way(ways, route.interface)) {
        add("network {} over gateway {}, line {}, {}, time-out {}, cost {}\n",
            networks_text(route.first, route.last), way->to.gateway, way->to.line,
            way->enter.empty() ? std::string("as a client")
                               : fmt::format("entered as a device of line {}", way->enter),
            format_duration(way->timeout), route.cost);
        continue;
      }
      const std::string via = route_text(route, names);
      add("network {}, cost {}\n",
          via.substr(0, via.rfind(' ')).replace(via.find(' '), 1, " over line "), route.cost);
    }
  }

  void entered(const routing::Config& routing) {
    if (routing.interface == 0) {
      return;
    }
    for (const auto& rule : routing.access) {
      add("  entered from networks {}: {}\n", networks_text(rule.first, rule.last),
          services_text(rule));
    }
    add("{}", routing.access.empty() ? "  entered from no other network\n" : "");
    std::string networks;
    for (unsigned network = 1; network <= 32; ++network) {
      if ((routing.emcy_networks[1] >> (network - 1) & 1U) != 0) {
        networks += (networks.empty() ? "" : ", ") + std::to_string(network);
      }
    }
    if (!networks.empty()) {
      add("  EMCYs go on to networks {}\n", networks);
    }
  }

  static std::string own_node(const line::LineConfig& c) {
    if (!c.devices.empty()) {
      return fmt::format("with {} device{}", c.devices.size(), c.devices.size() == 1 ? "" : "s");
    }
    if (c.role != line::Role::observer) {
      return fmt::format("with node-ID {}", c.node_id);
    }
    return c.node_id == 0 ? "that transmits nothing"
                          : fmt::format("that transmits nothing, of the master {}", c.node_id);
  }

  static std::string role_text(line::Role configured, line::Role started) {
    return configured == started ? std::string(name(started))
                                 : fmt::format("{}, at the start {} by its own value of 1F80:00,",
                                               name(configured), name(started));
  }

  void sleep(const nmt::SleepProtocol& sleep) {
    if (sleep.exists()) {
      add("  sleep: requests on {:03X}h, objections on {:03X}h for {}, silent after {}, asleep "
          "after "
          "{} more\n",
          sleep.request, sleep.objection, format_duration(sleep.check_time),
          format_duration(sleep.prepare_time), format_duration(sleep.silent_time));
    }
  }

  // Only for a line with an own node: a line with devices has none.
  void own_services(const line::LineConfig& c) {
    sleep(c.sleep);
    if (c.role == line::Role::observer) {
      add("  SYNC {}\n", c.sync_period == Duration::zero()
                             ? "not monitored"
                             : "expected every " + format_duration(c.sync_period));
      return;
    }
    add("  heartbeat {}, SYNC {}, TIME {}", off_or(c.heartbeat), off_or(c.sync_period),
        off_or(c.time_period));
    if (c.role == line::Role::manager) {
      add(", {}", master_services(c));
    }
    add("\n");
    startup(c);
    add("  clients use up to {}% of the bit rate, each of them {}%\n", c.request_share / 10,
        c.client_share / 10);
    if (const auto& pool = c.connection_pool; pool.pairs() != 0) {
      add("  CAN-IDs {:03X}h to {:03X}h for {} SDO connections between nodes\n", pool.first,
          pool.last, pool.pairs());
    }
    if (c.pdo_update_time != Duration::zero()) {
      add("  an object written by PDO waits {} for further objects of the PDO\n",
          format_duration(c.pdo_update_time));
    }
  }

  static std::string master_services(const line::LineConfig& c) {
    return fmt::format("SDO time-out {}, reset nodes {}, start nodes {}",
                       format_duration(c.sdo_timeout), c.reset_nodes, c.start_nodes);
  }

  void named_topics(const std::string& line_name, const config::NamedTopics& named) {
    if (named.published) {
      add("  a topic of each device and direction: plant/{}/DEVICE/inputs, .../outputs\n",
          line_name);
    }
    if (named.ros2) {
      add("  the same for ROS 2: /plant/{}/DEVICE/inputs, .../outputs, package {}\n",
          named::identifier_of(line_name), named::kRos2Package);
    }
    if (named.type_information) {
      add("  with a description of the types over DDS\n");
    }
    if (named.published && named.min_separation != Duration::zero()) {
      add("  at most one sample of such a topic in {}\n", format_duration(named.min_separation));
    }
    for (const auto& alias : named.aliases) {
      add("  {} {} is called {} in its topic\n", image::name(alias.direction), alias.entry,
          alias.identifier);
    }
  }

  void line(const config::LinePlan& plan) {
    const line::LineConfig c = as_started(plan.config);
    add("\nline {} on {}\n", c.name, plan.interface.uri);
    add("  {} {}, network-ID {}, bit rate {}\n", role_text(plan.config.role, c.role), own_node(c),
        c.network_id, c.bit_rate == 0 ? "not given" : fmt::format("{} bit/s", c.bit_rate));
    if (c.canopen_fd) {
      add("  CANopen FD, data bit rate {}, aborts of USDO with {}, EMCYs of {} bytes\n",
          c.data_bit_rate == 0 ? "not given" : fmt::format("{} bit/s", c.data_bit_rate),
          c.usdo_abort == usdo::AbortForm::one_byte ? "one byte" : "four bytes",
          c.emcy_fd ? 20 : 8);
    }
    if (c.devices.empty()) {
      own_services(c);
    }
    if (c.role != line::Role::observer) {
      add("  EMCY bytes: {}\n", node::name(c.error_scheme));
    }
    for (const line::OwnObject& own : c.own_objects) {
      add("  own object {} {}: {}{}{}{}\n", config::format_address({own.index, own.variable.sub}),
          own.variable.name, od::name(own.variable.type), own.variable.mappable ? ", for PDOs" : "",
          own.variable.store ? ", stored" : "", own.in_image ? ", in the image" : "");
    }
    for (const line::ObjectValue& own : c.own_values) {
      add("  own node: {} is written, {} bytes\n", config::format_address(own.address),
          own.data.size());
    }
    add("  access: commands {}, outputs {}; published {}; PDO updates every {} at most\n",
        config::name(plan.commands), config::name(plan.outputs), publish_text(plan.publish),
        format_duration(plan.pdo_min_period));
    for (const auto& [client, access] : plan.clients) {
      add("  access of {}: commands {}, outputs {}\n", client, config::name(access.commands),
          config::name(access.outputs));
    }
    entered(c.routing);
    add("  executor {}\n", plan.executor.empty() ? "of its own" : plan.executor);
    if (!plan.history.entries.empty()) {
      add("  history of {} entries, each at most every {}\n", plan.history.entries.size(),
          format_duration(plan.history.min_interval));
    }
    named_topics(c.name, plan.named);
    if (!plan.storage.empty()) {
      add("  stored parameters in {}\n", plan.storage);
    }
    if (plan.auto_scan) {
      add("  nodes: found by a scan{}{}{}\n", plan.auto_scan->at_start ? " at the start" : "",
          plan.auto_scan->set_up ? "; missing error control is configured, heartbeat " +
                                       format_duration(c.found_heartbeat)
                                 : "; nothing is written to them",
          plan.auto_scan->eds.empty() ? "" : "; device files in " + plan.auto_scan->eds);
    }
    for (const auto& node : c.nodes) {
      this->node(node, c.role, line::longest_pdo(c));
    }
    for (const auto& device : c.devices) {
      add("  device {} {}: {} ({})\n", device.id, device.name, device.device.product_name,
          device.device.file);
      pdos(device.device);
    }
    for (const auto& device : plan.simulated) {
      add("  simulated: node {} as {}{}\n", device.node, device.profile,
          device.unconfigured ? ", without a node-ID" : "");
    }
    if (const auto made = line::Line::make(c); made.value) {
      layout((*made.value)->layout(image::Direction::inputs));
      layout((*made.value)->layout(image::Direction::outputs));
      groups(c, plan.named, (*made.value)->layout(image::Direction::outputs));
    }
  }

  static std::string nodes_started(const line::LineConfig& c) {
    return fmt::format("nodes started {}, {}; mandatory nodes within {}, NMT commands every {}",
                       !c.start_nodes ? "by the application"
                       : c.start_all  ? "all together"
                                      : "one by one",
                       lost_text(c.on_error),
                       c.boot_time == Duration::zero() ? "any time" : format_duration(c.boot_time),
                       c.nmt_inhibit == Duration::zero() ? "0" : format_duration(c.nmt_inhibit));
  }

  void flying_master(const line::LineConfig& c) {
    if (!c.flying_master) {
      return;
    }
    const line::FlyingMasterConfig& from = *c.flying_master;
    const nmt::FlyingMasterTimes times = line::flying_master_times(c);
    add("  flying master: priority {}, waits {} and {} for the active master, its turn after {}; "
        "{} each {}, heartbeat of the master {}\n",
        times.priority, format_duration(times.negotiation_delay),
        format_duration(times.master_timeout),
        format_duration(times.priority * times.priority_slot + c.node_id * times.device_slot),
        from.forces_each_cycle ? "076h" : "073h", format_duration(times.detect_cycle),
        from.master_heartbeat != Duration::zero() ? format_duration(from.master_heartbeat)
        : c.heartbeat != Duration::zero()         ? format_duration(2 * c.heartbeat)
                                                  : "not monitored");
  }

  void startup(const line::LineConfig& c) {
    if (c.role == line::Role::manager) {
      add("  start-up: own node {}, {}\n", c.own_start ? "by itself" : "by the application",
          nodes_started(c));
      flying_master(c);
    } else if (c.role == line::Role::device) {
      add("  started by {}; nodes are observed\n", c.own_start ? "itself" : "its master");
      add("  {}{}, {}\n", kAsMaster, master_services(c), nodes_started(c));
    }
  }

  void node(const line::NodeConfig& node, line::Role role, std::size_t longest) {
    add("  node {} {}: {} ({}){}\n", node.id, node.name, node.device.product_name, node.device.file,
        role == line::Role::manager && node.mandatory ? ", mandatory" : "");
    const bool awaits_one = role != line::Role::manager && node.heartbeat != Duration::zero();
    add("    heartbeat {}{}, consumer {}", awaits_one ? "expected " : "", heartbeat_text(node),
        node.heartbeat_consumer != Duration::zero() ? format_duration(node.heartbeat_consumer)
        : node.heartbeat != Duration::zero()        ? "2.5 x that"
                                                    : "off");
    if (role == line::Role::manager) {
      add(", {}\n    {}\n", identity(node), boot(node));
    } else {
      add("\n");
    }
    if (role == line::Role::device) {
      add("    {}{}{}, {}\n", kAsMaster, node.mandatory ? "mandatory, " : "", identity(node),
          boot(node));
    }
    if (node.pdo_deadline != Duration::zero()) {
      add("    its PDOs are late after {}\n", format_duration(node.pdo_deadline));
    }
    for (const auto& [number, cycle] : node.srdo_cycle) {
      add("    its SRDO {} is unsafe {} after the last valid pair\n", number,
          format_duration(cycle));
    }
    for (const auto& [number, validation] : node.srdo_validation) {
      add("    its SRDO {} is unsafe if a pair takes longer than {}\n", number,
          format_duration(validation));
    }
    if (node.guard_time != Duration::zero()) {
      add("    guarding every {}, life time factor {}\n", format_duration(node.guard_time),
          node.life_time_factor);
    }
    for (const manager::ObjectWrite& write : writes_of_file(node)) {
      object(node, write.address, write.data, role, ", of its DCF");
    }
    for (const auto& value : node.objects) {
      object(node, value.address, value.data, role, "");
    }
    pdos(node.device, longest);
  }

  void object(const line::NodeConfig& node, od::Address address, std::span<const std::byte> value,
              line::Role role, std::string_view origin) {
    constexpr std::size_t kLongest = 32;
    if (role == line::Role::observer) {
      return;
    }
    add("    {}write {} = ", role == line::Role::manager ? "" : kAsMaster,
        config::format_address(address));
    if (value.size() > kLongest) {
      add("{} bytes{}\n", value.size(), origin);
      return;
    }
    const od::VariableDescription* const known = node.device.find(address);
    add("{}{}\n", value_text(known == nullptr ? od::DataType::none : known->type, value), origin);
  }

  // The heartbeat that the device produces: `heartbeat`, or 1017h as `objects`, its DCF or its
  // device file has it. Guarding switches it off.
  static std::string heartbeat_text(const line::NodeConfig& node) {
    constexpr od::Address kProducerTime{od::objects::kProducerHeartbeatTime, 0};
    if (node.heartbeat != Duration::zero() || node.guard_time != Duration::zero()) {
      return off_or(node.heartbeat);
    }
    const auto text = [](const std::vector<std::byte>& value, std::string_view origin) {
      const std::uint64_t time = value.size() <= 2 ? load_le(std::span(value)) : 0;
      return time == 0
                 ? "off"
                 : fmt::format("{} {}", format_duration(std::chrono::milliseconds(time)), origin);
    };
    for (auto it = node.objects.rbegin(); it != node.objects.rend(); ++it) {
      if (it->address == kProducerTime) {
        return text(it->data, "by objects");
      }
    }
    const od::VariableDescription* const described = node.device.find(kProducerTime);
    return described == nullptr
               ? "off"
               : text(described->value, described->configured ? "by its DCF" : "by its default");
  }

  static std::string identity(const line::NodeConfig& node) {
    return fmt::format("boot within {}, identity {}{}", format_duration(node.boot_timeout),
                       scope_text(node),
                       node.serial ? fmt::format(", serial number {}", *node.serial) : "");
  }

  static std::string boot(const line::NodeConfig& node) {
    return fmt::format("{}{}, reset within {}, SDO time-out {}{}",
                       node.boot ? "booted" : "only its error control is started",
                       node.keep_alive ? ", kept alive" : "", format_duration(node.reset_time),
                       node.sdo_timeout == Duration::zero() ? "that of the line"
                                                            : format_duration(node.sdo_timeout),
                       node.block_from == sdo::kNoBlocks ? ", no SDO block transfer" : "");
  }

  void pdos(const od::DeviceDescription& device, std::size_t longest = 64) {
    const auto described = pdo::describe_pdos(device, longest);
    if (described.value) {
      for (const auto& p : described.value->tpdos) {
        pdo("TPDO", p, device);
      }
      for (const auto& p : described.value->rpdos) {
        pdo("RPDO", p, device);
      }
    }
  }

  void pdo(std::string_view kind, const pdo::Parameters& p, const od::DeviceDescription& device) {
    add("    {}{} {:03X}h {}", kind, p.number, p.cob_id.id(), transmission(p.type));
    if (p.inhibit != Duration::zero()) {
      add(", inhibit {}", format_duration(p.inhibit));
    }
    if (p.event_timer != Duration::zero()) {
      add(", timer {}", format_duration(p.event_timer));
    }
    add(":");
    for (const auto& mapped : p.mapping) {
      const auto* variable = device.find(mapped.address);
      add(" {}/{}{}", config::format_address(mapped.address), mapped.bits,
          variable == nullptr ? "" : " \"" + variable->name + "\"");
    }
    add("\n");
  }

  void layout(const image::Layout& layout) {
    add("  {}: {} entries in {} bytes, layout {}\n", name(layout.direction), layout.entries.size(),
        layout.byte_size, hex64(layout.id));
    if (layout.entries.empty()) {
      return;
    }
    add("    {:>5} {:>8} {:>4} {:<11} {:>7} {:>6} {:>5} {:>8}  {}\n", "entry", "byte.bit", "bits",
        "type", "object", "remote", "local", "variable", "name");
    for (std::size_t i = 0; i < layout.entries.size(); ++i) {
      const auto& e = layout.entries[i];
      const std::string meaning = image::meaning_text(e.scaling, e.low, e.high);
      add("    {:>5} {:>6}.{} {:>4} {:<11} {:>7} {:>6} {:>5} {:>8}  {}{}\n", i, e.bit_offset / 8,
          e.bit_offset % 8, e.bit_length, od::name(e.type),
          config::format_address({e.index, e.sub}), image::pdo_cell(e.remote_pdo), e.local_pdo,
          e.variable_index == 0 ? "-" : config::format_address({e.variable_index, e.variable_sub}),
          e.name, meaning.empty() ? "" : " (" + meaning + ')');
    }
  }

  void groups(const line::LineConfig& config, const config::NamedTopics& named,
              const image::Layout& outputs) {
    for (const auto& group : config.groups) {
      add("  output group {} {}, sent {}{}{}:", group.number, group.name,
          group.send_always ? "always" : "on change",
          group.forwarded ? ", written by that line of another gateway" : "",
          named.has_group(group.number)
              ? fmt::format(", written by plant/{}/{}/outputs/set", config.name, group.name)
              : "");
      for (const auto entry : group.entries) {
        add(" {}", outputs.entries[entry].name);
      }
      add("\n");
    }
    for (const auto& value : config.defaults) {
      const image::Entry& entry = outputs.entries[value.entry];
      const bool scaled = entry.scaling.is_scaled() && entry.initial;
      add("  default {} = {:X}h{}\n", entry.name, value.value,
          scaled ? fmt::format(", {} {}", image::number_text(*entry.initial), entry.scaling.unit)
                 : "");
    }
  }

  std::string out_;
};

}  // namespace

std::string describe(const config::Plant& plant) {
  Text text;
  text.plant(plant);
  return text.take();
}

int check(const std::string& path, bool json, const std::string& dds_profile) {
  auto loaded = config::load(path);
  add_hints(loaded);
  if (loaded.value) {
    if (!dds_profile.empty()) {
      loaded.value->dds_profile = dds_profile;
    }
    auto found = check_dds_profiles(loaded.value->dds_profile);
    const auto identity = check_dds_identity(*loaded.value, std::time(nullptr));
    found.insert(found.end(), identity.begin(), identity.end());
    loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
    if (has_errors(found)) {
      loaded.value.reset();
    }
  }
  if (json) {
    std::cout << to_json(loaded) << '\n';
  } else {
    print(loaded.diagnostics);
    if (loaded.value) {
      std::cout << describe(*loaded.value);
    }
  }
  return loaded.ok() ? kExitOk : kExitUsage;
}

}  // namespace linegate::gateway
