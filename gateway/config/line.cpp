// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "bridges/sim/device.h"
#include "gateway/config/certificate_name.h"
#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

constexpr Duration kLongest = std::chrono::hours(1);

void read_role(Section& section, line::LineConfig& config) {
  const YAML::Node node = section.find("role");
  section.choose<line::Role>(node, config.role,
                             {{"manager", line::Role::manager},
                              {"observer", line::Role::observer},
                              {"device", line::Role::device}});
  if (config.role == line::Role::observer) {
    config.node_id = 0;
  }
}

void read_access(Section& from, const YAML::Node& node, Access& target) {
  from.choose<Access>(node, target,
                      {{"off", Access::off}, {"read", Access::read}, {"all", Access::all}});
}

// "operator/panel3": role and name of a certificate (gateway/security/authority.h).
bool is_client(std::string_view text) {
  const std::size_t slash = text.find('/');
  const std::string_view role = text.substr(0, slash);
  return slash != std::string_view::npos && (role == "operator" || role == "engineer") &&
         is_certificate_name(text.substr(slash + 1));
}

LineAccess read_client_access(Section& clients, const YAML::Node& node, const std::string& client) {
  LineAccess out;
  if (!node.IsMap()) {
    read_access(clients, node, out.commands);
    out.outputs = out.commands;
    return out;
  }
  Section access(clients.findings(), node, "the access of " + client);
  read_access(access, access.require("commands"), out.commands);
  read_access(access, access.require("outputs"), out.outputs);
  access.done();
  return out;
}

void read_clients(Findings& findings, const YAML::Node& node, LinePlan& plan) {
  Section clients(findings, node, "clients");
  if (!clients.valid()) {
    return;
  }
  for (const auto& pair : node) {
    const std::string client = pair.first.IsScalar() ? pair.first.Scalar() : std::string();
    clients.find(client);
    if (!is_client(client)) {
      findings.error(place_of(pair.first),
                     "\"" + client +
                         "\" is no client that sends requests: write the role and "
                         "the name of its certificate, such as operator/panel3 "
                         "or engineer/anna");
      continue;
    }
    plan.clients[client] = read_client_access(clients, pair.second, client);
  }
  clients.done();
}

void read_access(Section& section, LineSection& out) {
  LinePlan& plan = out.plan;
  const YAML::Node node = section.find("access");
  if (!node.IsDefined()) {
    return;
  }
  if (!node.IsMap()) {
    read_access(section, node, plan.commands);
    plan.outputs = plan.commands;
    return;
  }
  Section access(section.findings(), node, "access");
  read_access(access, access.find("commands"), plan.commands);
  read_access(access, access.find("outputs"), plan.outputs);
  const YAML::Node clients = access.find("clients");
  if (clients.IsDefined()) {
    out.clients_place = place_of(clients);
    read_clients(section.findings(), clients, plan);
  }
  access.done();
}

void read_publish(Section& section, Publish& publish) {
  const YAML::Node node = section.find("publish");
  if (!node.IsDefined()) {
    return;
  }
  if (!node.IsMap()) {
    section.choose<Publish::Rule>(
        node, publish.rule,
        {{"on_change", Publish::Rule::on_change}, {"on_sync", Publish::Rule::on_sync}});
    return;
  }
  Section rules(section.findings(), node, "publish");
  const YAML::Node change = rules.find("on_change");
  const YAML::Node period = rules.find("period");
  if (change.IsDefined()) {
    Section rule(section.findings(), change, "on_change");
    rule.read("min_separation", publish.time, Duration::zero(), kLongest);
    rule.done();
  }
  if (period.IsDefined()) {
    publish.rule = Publish::Rule::period;
    rules.read("period", publish.time, milliseconds(1), kLongest);
  }
  rules.done();
  if (change.IsDefined() == period.IsDefined()) {
    section.findings().error(place_of(node),
                             "publish is one of on_change, on_sync, {on_change: {min_separation: "
                             "10ms}}, {period: 100ms}");
  }
}

void read_identity(Section& section, line::Identity& identity) {
  const YAML::Node node = section.find("identity");
  if (!node.IsDefined()) {
    return;
  }
  constexpr std::uint64_t kMax = 0xFFFF'FFFF;
  Section from(section.findings(), node, "identity");
  from.read_number("device_type", identity.device_type, 0, kMax);
  from.read_number("vendor", identity.vendor, 0, kMax);
  from.read_number("product", identity.product, 0, kMax);
  from.read_number("revision", identity.revision, 0, kMax);
  from.read_number("serial", identity.serial, 0, kMax);
  from.done();
}

// Quotes a word for a shell command.
std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain = "-_./:,@%+=";
  const bool plain = std::all_of(text.begin(), text.end(), [&](unsigned char c) {
    return std::isalnum(c) != 0 || kPlain.find(static_cast<char>(c)) != std::string_view::npos;
  });
  std::string out = plain ? text : "'";
  for (const char c : plain ? std::string() : text) {
    out += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return out + (plain ? "" : "'");
}

// The command that puts the simulated devices of the line on its interface from another process.
std::string simulate_command(const LinePlan& plan) {
  std::string out = "linegate simulate " + shell_word(plan.interface.uri);
  for (const SimulatedDevice& device : plan.simulated) {
    out += " --device " + shell_word(device.profile + ':' + std::to_string(device.node) +
                                     (device.unconfigured ? ":unconfigured" : ""));
  }
  return out;
}

// An error message for `simulate` on an interface that does not support it.
std::string no_place_for_simulated(const LinePlan& plan) {
  if (plan.interface.scheme == Scheme::virtual_bus) {
    return "simulate needs the interface simulated:, which is virtual: with devices on it";
  }
  return "simulate needs the interface simulated:; for " + plan.interface.uri +
         " run the command: " + simulate_command(plan);
}

void read_simulated(Section& section, LinePlan& plan) {
  std::vector<std::string> profiles;
  for (const auto profile : sim::profiles()) {
    profiles.emplace_back(profile);
  }
  const YAML::Node list = section.find("simulate");
  for (const YAML::Node& element : elements(section.findings(), list, "simulate", kMostNodes)) {
    SimulatedDevice device;
    Section from(section.findings(), element, "a simulated device");
    const YAML::Node node = from.require("node");
    if (const auto number = from.number(node, 1, 127)) {
      device.node = static_cast<std::uint8_t>(*number);
    }
    const YAML::Node profile = from.require("profile");
    if (const auto text = from.text(profile)) {
      device.profile = *text;
      if (std::find(profiles.begin(), profiles.end(), *text) == profiles.end()) {
        from.not_one_of(profile, *text, profiles);
      } else if (sim::needs_fd(*text) && !plan.config.canopen_fd) {
        section.findings().error(place_of(profile),
                                 *text +
                                     " is a device of CANopen FD: the line needs canopen_fd: "
                                     "true");
      }
    }
    from.read("unconfigured", device.unconfigured);
    if (const auto serial = from.number(from.find("serial"), 0, 0xFFFF'FFFF)) {
      device.serial = static_cast<std::uint32_t>(*serial);
    }
    from.done();
    const bool twice = std::any_of(
        plan.simulated.begin(), plan.simulated.end(),
        [&](const auto& other) { return device.node != 0 && other.node == device.node; });
    if (twice || (device.node != 0 && device.node == plan.config.node_id)) {
      section.findings().error(
          place_of(node), "node-ID " + std::to_string(device.node) +
                              (twice ? " is simulated already" : " is the line's own node_id"));
    }
    device.fd = plan.config.canopen_fd;
    device.emcy_fd = plan.config.emcy_fd;
    plan.simulated.push_back(std::move(device));
  }
  if (list.IsDefined() && plan.interface.scheme != Scheme::simulated) {
    section.findings().error(place_of(list), no_place_for_simulated(plan));
  }
}

void read_storage(Section& section, std::string& folder) {
  const YAML::Node node = section.find("storage");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto path =
      (std::filesystem::path(section.findings().file()).parent_path() / *text).lexically_normal();
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_directory(path, ignored)) {
    section.findings().error(place_of(node), path.string() + " is no folder");
  }
  folder = path.string();
}

// Reports conflicts of the node with the line or with earlier nodes.
void check_clashes(Findings& findings, const line::LineConfig& config, const line::NodeConfig& node,
                   Place place) {
  const auto clash = [&](const std::string& text) { findings.error(place, text); };
  for (const auto& other : config.nodes) {
    if (other.id == node.id && node.id != 0) {
      clash("node-ID " + std::to_string(node.id) + " is that of \"" + other.name + "\" already");
    }
    if (other.name == node.name) {
      clash("another node is called \"" + node.name + "\"");
    }
  }
  if (node.id != 0 && node.id == config.node_id) {
    clash("node-ID " + std::to_string(node.id) + " is the line's own node_id");
  }
}

// `nodes:`, and the nodes of `node_list:` that `nodes:` lacks.
void read_nodes(Section& section, LineSection& line) {
  Findings& findings = section.findings();
  line::LineConfig& config = line.plan.config;
  for (const YAML::Node& element : elements(findings, section.find("nodes"), "nodes", kMostNodes)) {
    line::NodeConfig node = read_node(findings, element, line::longest_pdo(config));
    check_clashes(findings, config, node, place_of(element));
    line.node_places.push_back({node.id, place_of(element)});
    config.nodes.push_back(std::move(node));
  }
  const YAML::Node list = section.find("node_list");
  for (line::NodeConfig& node : read_node_list(findings, list)) {
    if (std::ranges::find(config.nodes, node.id, &line::NodeConfig::id) == config.nodes.end()) {
      check_clashes(findings, config, node, place_of(list));
      line.node_places.push_back({node.id, place_of(list)});
      config.nodes.push_back(std::move(node));
    }
  }
  std::stable_sort(config.nodes.begin(), config.nodes.end(),
                   [](const auto& a, const auto& b) { return a.id < b.id; });
}

// A whole percentage from 1% to 100%, into thousandths.
void read_share(Section& section, const char* key, std::uint16_t& permille) {
  const YAML::Node node = section.find(key);
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const bool has_unit = text->ends_with('%');
  const auto percent =
      has_unit ? parse_unsigned(std::string_view(*text).substr(0, text->size() - 1)) : std::nullopt;
  if (!percent || *percent < 1 || *percent > 100) {
    section.findings().error(place_of(node),
                             "expected a share from 1% to 100%, got \"" + *text + "\"");
    return;
  }
  permille = static_cast<std::uint16_t>(*percent * 10U);
}

void read_own_node(Section& section, line::LineConfig& config) {
  section.read_number("node_id", config.node_id, 1, 127);
  section.read_multiple("heartbeat", config.heartbeat, milliseconds(1), milliseconds(65'535));
  section.read_multiple("sync", config.sync_period, std::chrono::microseconds(1),
                        std::chrono::seconds(60));
  section.read_multiple("time", config.time_period, milliseconds(10), std::chrono::hours(24));
  section.read("sdo_timeout", config.sdo_timeout, milliseconds(1), std::chrono::minutes(10));
  section.read("pdo_update_time", config.pdo_update_time, Duration::zero(),
               std::chrono::minutes(1));
  section.read("save_timeout", config.save_timeout, milliseconds(1), std::chrono::minutes(10));
  section.read("load_timeout", config.load_timeout, milliseconds(1), std::chrono::minutes(10));
  section.read_choice<node::ErrorScheme>(
      "emcy_bytes", config.error_scheme,
      {{"number", node::ErrorScheme::number},
       {"temporary_and_sticky", node::ErrorScheme::temporary_and_sticky}});
  section.read("reset_nodes", config.reset_nodes);
  section.read("start_nodes", config.start_nodes);
  read_identity(section, config.identity);
}

void report_ignored_keys(Findings& findings, const YAML::Node& section, const char* key) {
  const YAML::Node node = section[key];
  if (node.IsDefined()) {
    findings.warning(place_of(node),
                     std::string(key) + " has no effect on an observer, which transmits nothing");
  }
}

// An observer uses only the device file, error control, PDOs and their deadlines of a node.
void report_ignored_keys_of_nodes(Findings& findings, const YAML::Node& nodes) {
  if (!nodes.IsDefined() || !nodes.IsSequence()) {
    return;
  }
  for (const YAML::Node& node : nodes) {
    if (!node.IsMap()) {
      continue;
    }
    for (const char* key :
         {"boot", "mandatory", "keep_alive", "boot_timeout", "reset_time", "sdo_timeout", "sdo",
          "check", "check_identity", "serial", "restore", "store", "program"}) {
      report_ignored_keys(findings, node, key);
    }
  }
}

// Warnings, not errors: the configuration of a manager must work for an observer of the same line.
void report_ignored_keys(Section& section, const line::LineConfig& config) {
  if (config.role != line::Role::observer) {
    return;
  }
  for (const char* key :
       {"heartbeat",       "time",         "sdo_timeout",      "save_timeout",    "load_timeout",
        "pdo_update_time", "emcy_bytes",   "reset_nodes",      "start_nodes",     "startup",
        "identity",        "strict_ixxat", "keep_operational", "canopenia_base",  "own_objects",
        "own_values",      "mpdo_scanner", "mpdo_dispatcher",  "own_concise_dcf", "storage",
        "outputs",         "lss",          "request_share",    "client_share",    "sdo_connections",
        "flying_master"}) {
    const YAML::Node node = section.find(key);
    if (node.IsDefined()) {
      section.findings().warning(place_of(node), std::string(key) +
                                                     " has no effect on an observer, which "
                                                     "transmits nothing");
    }
  }
  report_ignored_keys_of_nodes(section.findings(), section.find("nodes"));
}

// Its name, its interface and the bit rate of that.
void read_interface_of_line(Section& section, LineSection& out) {
  LinePlan& plan = out.plan;
  const YAML::Node name = section.require("name");
  if (auto text = section.text(name)) {
    check_line_name(section.findings(), *text, place_of(name));
    plan.config.name = std::move(*text);
    out.place = place_of(name);
  }
  const YAML::Node interface = section.require("interface");
  out.interface_place = place_of(interface);
  plan.interface = read_interface(section, interface);
  if (plan.interface.scheme == Scheme::simulated) {
    plan.interface.name = plan.config.name;
  }
  const YAML::Node rate = section.find("bit_rate");
  if (const auto text = section.text(rate)) {
    if (const auto value = parse_bit_rate(*text)) {
      plan.config.bit_rate = *value;
    } else {
      section.findings().error(place_of(rate),
                               "expected a bit rate such as 500kbit, got \"" + *text + "\"");
    }
  }
}

void read_pdo_update(Section& section, LinePlan& plan) {
  const YAML::Node update = section.find("pdo_update");
  if (update.IsDefined()) {
    Section from(section.findings(), update, "pdo_update");
    from.read("min_period", plan.pdo_min_period, Duration::zero(), kLongest);
    plan.config.pdo_queue = read_pdo_queue(from).value_or(0);
    if (plan.config.pdo_queue != 0 && plan.config.role == line::Role::device) {
      section.findings().error(
          place_of(update),
          "every is of lines in the roles manager and observer: one in the role device "
          "receives no TPDOs of nodes");
    }
    from.done();
  }
}

}  // namespace

LineSection read_line(Findings& findings, const YAML::Node& node) {
  LineSection out;
  LinePlan& plan = out.plan;
  plan.config.network_id = 0;
  Section section(findings, node, "a line");
  out.place = section.place();

  read_interface_of_line(section, out);
  const YAML::Node network = section.find("network_id");
  out.network_place = network.IsDefined() ? place_of(network) : out.place;
  section.read_number("network_id", plan.config.network_id, 1, 127);

  read_role(section, plan.config);
  read_own_node(section, plan.config);
  read_canopen_fd(section, plan);
  report_ignored_keys(section, plan.config);
  read_lss(section, plan.config);
  read_flying_master(section, plan.config);
  read_sleep(section, plan.config);
  read_diagnosis(section, plan.config);
  read_connections(section, plan.config);
  read_access(section, out);
  read_share(section, "request_share", plan.config.request_share);
  read_share(section, "client_share", plan.config.client_share);
  const YAML::Node enter = section.find("enter");
  out.enter_place = place_of(enter);
  out.enter = read_enter(findings, enter);
  read_emcy_routing(section, out);
  read_publish(section, plan.publish);
  read_pdo_update(section, plan);
  const YAML::Node executor = section.find("executor");
  out.executor_place = place_of(executor);
  section.read("executor", plan.executor);
  read_storage(section, plan.storage);
  if (plan.config.role == line::Role::observer) {
    plan.storage.clear();
  }
  plan.config.stores_parameters = !plan.storage.empty();
  read_devices(section, out);
  read_own_objects(section, plan.config);
  read_mpdo_lists(section, plan.config);
  out.own_values = read_own_values(section, plan.config);
  plan.record = read_record(section, out.record_place);
  read_nodes(section, out);
  read_startup(section, plan.config);
  read_auto(section, plan);
  read_simulated(section, plan);
  out.own_pdos = read_own_pdos(findings, section.find("own_pdos"));
  read_feeds_every_tpdo(section, out);
  out.outputs = read_outputs(findings, section.find("outputs"));
  out.history = read_history(section, plan.history);
  out.named = read_named(section, plan.named);
  section.done();
  return out;
}

}  // namespace linegate::config
