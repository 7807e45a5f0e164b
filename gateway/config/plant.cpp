// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/plant.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include "bridges/named/identifiers.h"
#include "gateway/config/document.h"
#include "gateway/config/joined_lines.h"
#include "gateway/config/reader.h"
#include "gateway/config/sections.h"
#include "gateway/config/source.h"
#include "gateway/config/whole_file.h"

namespace linegate::config {
namespace {

constexpr std::uint64_t kMostDdsParticipants = 10'000;
constexpr std::uint64_t kHighestDdsDomain = 232;  // DDSI-RTPS 9.6.1.1 with the default ports

void read_gateway(Findings& findings, const YAML::Node& node, Plant& plant) {
  if (!node.IsDefined()) {
    return;
  }
  Section section(findings, node, "gateway");
  const YAML::Node name = section.find("name");
  if (auto text = section.text(name); text && check_name(findings, *text, place_of(name), "name")) {
    plant.gateway = std::move(*text);
  }
  section.read_choice<LogLevel>("log", plant.log,
                                {{"trace", LogLevel::trace},
                                 {"debug", LogLevel::debug},
                                 {"info", LogLevel::info},
                                 {"warning", LogLevel::warning},
                                 {"error", LogLevel::error},
                                 {"off", LogLevel::off}});
  section.done();
}

void read_dds_memory(Section& section, Plant& plant) {
  const YAML::Node node = section.find("memory");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto size = parse_size(*text);
  if (size && *size >= kLeastDdsMemory && *size <= kMostDdsMemory) {
    plant.dds_memory = *size;
  } else {
    section.findings().error(place_of(node),
                             "expected a size from " + format_size(kLeastDdsMemory) + " to " +
                                 format_size(kMostDdsMemory) + ", got \"" + *text + "\"");
  }
}

// Names or addresses of interfaces or hosts.
std::vector<std::string> read_places(Section& section, const char* key) {
  constexpr std::size_t kMostPlaces = 64;
  constexpr std::size_t kLongestPlace = 253;  // RFC 1035
  std::vector<std::string> out;
  for (const YAML::Node& element :
       elements(section.findings(), section.find(key), key, kMostPlaces)) {
    const std::string text = element.IsScalar() ? element.Scalar() : std::string();
    const bool plain = text.find_first_not_of(
                           "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:@") ==
                       std::string::npos;
    if (text.empty() || text.size() > kLongestPlace || !plain) {
      section.findings().error(
          place_of(element), std::string("expected a name or an IPv4 address in \"") + key + "\"");
    } else {
      out.push_back(text);
    }
  }
  return out;
}

bool is_number_up_to(std::string_view text, std::uint64_t most) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && text.size() <= 5 && std::ranges::all_of(text, digit) &&
         std::stoull(std::string(text)) <= most;
}

// Returns the ID of a discovery server in the same form as for dds::parse_discovery_server();
// nothing if the text has another one.
std::optional<std::uint64_t> id_of_discovery_server(std::string_view text, std::uint64_t position) {
  constexpr std::uint64_t kHighestId = 255;
  constexpr std::uint64_t kHighestPort = 65'535;
  std::uint64_t id = position;
  if (const auto at = text.find('@'); at != text.npos) {
    if (!is_number_up_to(text.substr(0, at), kHighestId)) {
      return std::nullopt;
    }
    id = std::stoull(std::string(text.substr(0, at)));
    text.remove_prefix(at + 1);
  }
  const auto colon = text.find(':');
  const bool has_port = colon != text.npos;
  const bool is_right = colon != 0 && !text.empty() && text.find('@') == text.npos &&
                        (!has_port || (is_number_up_to(text.substr(colon + 1), kHighestPort) &&
                                       std::stoul(std::string(text.substr(colon + 1))) != 0));
  return is_right ? std::optional(id) : std::nullopt;
}

// After the peers and the folder of DDS-Security.
void read_discovery_servers(Section& section, Plant& plant) {
  const YAML::Node node = section.find("discovery_servers");
  plant.dds_servers = read_places(section, "discovery_servers");
  Findings& findings = section.findings();
  std::set<std::uint64_t> ids;
  for (std::size_t i = 0; i < plant.dds_servers.size(); ++i) {
    const auto id = id_of_discovery_server(plant.dds_servers[i], i);
    if (!id) {
      findings.error(place_of(node), "expected a discovery server [ID@]HOST[:PORT], got \"" +
                                         plant.dds_servers[i] + "\"");
    } else if (!ids.insert(*id).second) {
      findings.error(place_of(node), "two discovery servers have the ID " + std::to_string(*id) +
                                         ": without ID@ it is the position in the list, from 0");
    }
  }
  if (!plant.dds_servers.empty() && !plant.dds_peers.empty()) {
    findings.error(place_of(node),
                   "\"peers\" are for a gateway without \"discovery_servers\": with them it "
                   "announces itself to the servers alone");
  }
  if (!plant.dds_servers.empty() && !plant.dds_security.empty()) {
    findings.error(place_of(node), "\"discovery_servers\" are for DDS without security");
  }
}

// Returns the folder, relative to that of the file; empty without the key.
std::string read_folder(Section& section, const char* key) {
  const YAML::Node node = section.find(key);
  const auto text = section.text(node);
  if (!text) {
    return {};
  }
  const auto path = std::filesystem::path(section.findings().file()).parent_path() / *text;
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) {
    section.findings().error(place_of(node), "there is no folder " + path.string());
  }
  return path.string();
}

void read_identities(Section& section, Plant& plant) {
  plant.dds_security = read_folder(section, "security");
  plant.dds_routes_security = read_folder(section, "routes_security");
  if (!plant.dds_routes_security.empty() && plant.dds_security.empty()) {
    section.findings().error(place_of(section.find("routes_security")),
                             "\"routes_security\" is for DDS with security: the gateway needs an "
                             "identity of its own, too");
  }
}

// The guard confines what readers announce: it must see all of it.
void read_fan_out(Section& section, Plant& plant) {
  const YAML::Node fan_out = section.find("fan_out");
  section.read_choice<bool>("fan_out", plant.dds_multicast,
                            {{"unicast", false}, {"multicast", true}});
  if (!plant.dds_multicast) {
    return;
  }
  if (!plant.dds_security.empty()) {
    section.findings().error(place_of(fan_out),
                             "\"fan_out: multicast\" is for DDS without security: the guard cannot "
                             "check encrypted announcements of readers, and those can end the "
                             "gateway");
  }
  if (!plant.dds_guard) {
    section.findings().error(place_of(fan_out),
                             "\"fan_out: multicast\" needs \"guard: on\": announcements of readers "
                             "that nobody checks can end the gateway");
  }
  if (!plant.dds_servers.empty()) {
    section.findings().error(
        place_of(fan_out),
        "\"fan_out: multicast\" is not for \"discovery_servers\", which are for "
        "networks without multicast");
  }
}

void read_dds(Findings& findings, const YAML::Node& node, Plant& plant) {
  plant.dds_own_process = true;
  if (!node.IsDefined()) {
    return;
  }
  Section section(findings, node, "dds");
  section.read_number("domain", plant.dds_domain, 0, kHighestDdsDomain);
  section.read_number("participants", plant.dds_participants, 1, kMostDdsParticipants);
  plant.dds_interfaces = read_places(section, "interfaces");
  plant.dds_peers = read_places(section, "peers");
  const YAML::Node profile = section.find("profile");
  if (const auto text = section.text(profile)) {
    const auto path = std::filesystem::path(findings.file()).parent_path() / *text;
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) {
      findings.error(place_of(profile), "there is no file " + path.string());
    }
    plant.dds_profile = path.string();
  }
  read_identities(section, plant);
  read_discovery_servers(section, plant);
  const YAML::Node partitions = section.find("partitions");
  section.read("partitions", plant.dds_partitions);
  if (plant.dds_partitions && !plant.dds_security.empty()) {
    findings.error(
        place_of(partitions),
        "\"partitions\" is for DDS without security: the permissions of a gateway allow it to "
        "publish in the default partition alone");
  }
  section.read_choice<bool>("guard", plant.dds_guard, {{"on", true}, {"off", false}});
  read_fan_out(section, plant);
  section.read_choice<bool>("process", plant.dds_own_process, {{"same", false}, {"own", true}});
  read_dds_memory(section, plant);
  section.done();
}

void read_executors(Findings& findings, const YAML::Node& node, Plant& plant) {
  for (const YAML::Node& element : elements(findings, node, "executors", kMostNodes)) {
    ExecutorPlan plan;
    Section section(findings, element, "an executor");
    const YAML::Node name = section.require("name");
    if (auto text = section.text(name)) {
      check_name(findings, *text, place_of(name), "name");
      plan.name = std::move(*text);
    }
    section.read_number("priority", plan.priority, 0, 99);
    if (const auto processor = section.number(section.find("processor"), 0, 1023)) {
      plan.processor = static_cast<unsigned>(*processor);
    }
    section.read("lock_memory", plan.lock_memory);
    section.done();
    const bool twice = std::any_of(plant.executors.begin(), plant.executors.end(),
                                   [&](const auto& other) { return other.name == plan.name; });
    if (twice) {
      findings.error(place_of(name), "another executor is called \"" + plan.name + "\"");
    }
    plant.executors.push_back(std::move(plan));
  }
}

// Without DDS-Security the name of a client is a claim.
void check_clients(Findings& findings, const LineSection& section, const Plant& plant) {
  if (!section.plan.clients.empty() && plant.dds_security.empty()) {
    findings.error(section.clients_place,
                   "clients of \"access\" need DDS-Security, which proves the name of a client: "
                   "dds: {security: FOLDER}");
  }
}

// Nodes of ROS 2 are in the default partition, and two lines may have one name there.
void check_ros2(Findings& findings, const LineSection& line, const std::vector<LineSection>& others,
                const Plant& plant) {
  if (!line.plan.named.ros2) {
    return;
  }
  if (!plant.dds_security.empty()) {
    findings.error(
        line.named.ros2_place,
        "\"ros2\" is for DDS without security: the permissions of identities have no topics "
        "of ROS 2");
  }
  const auto name_of = [](const LineSection& of) {
    return named::identifier_of(of.plan.config.name);
  };
  for (const LineSection& other : others) {
    if (other.plan.named.ros2 && name_of(other) == name_of(line)) {
      findings.error(line.named.ros2_place, "line \"" + other.plan.config.name +
                                                "\" has the same name in ROS 2: " + name_of(line));
    }
  }
}

void check_executor(Findings& findings, const LineSection& section, const Plant& plant) {
  if (section.plan.executor.empty()) {
    return;
  }
  std::vector<std::string> names;
  for (const auto& executor : plant.executors) {
    names.push_back(executor.name);
  }
  if (std::find(names.begin(), names.end(), section.plan.executor) == names.end()) {
    const std::string guess = nearest(section.plan.executor, names);
    findings.error(section.executor_place,
                   "there is no executor \"" + section.plan.executor + "\" in executors" +
                       (guess.empty() ? "" : "; did you mean \"" + guess + "\"?"));
  }
}

// Includes the network-ID, which may follow from the position in the list.
std::string source_of(const YAML::Node& line, const LinePlan& plan, const std::string& files) {
  return canonical(line) + std::to_string(plan.config.network_id) + ';' + files;
}

// The executor of the line once all lines are known: joined lines share one.
std::string executor_source(const LinePlan& plan, const Plant& plant) {
  std::string out = plan.executor + '(';
  for (const auto& executor : plant.executors) {
    if (executor.name == plan.executor) {
      out += std::to_string(executor.priority) + ',' +
             (executor.processor ? std::to_string(*executor.processor) : "any") + ',' +
             (executor.lock_memory ? "locked" : "");
    }
  }
  return out + ')';
}

// Lines with the same `virtual:` name are on one bus inside this process.
bool shares_bus(const LineSection& line, const LineSection& other) {
  return line.plan.interface.scheme == Scheme::virtual_bus &&
         other.plan.interface.scheme == Scheme::virtual_bus &&
         line.plan.interface.name == other.plan.interface.name;
}

std::vector<unsigned> node_ids(const line::LineConfig& config) {
  std::vector<unsigned> out;
  for (const line::DeviceConfig& device : config.devices) {
    if (!device.lss) {
      out.push_back(device.id);
    }
  }
  if (config.devices.empty() && config.role != line::Role::observer) {
    out.push_back(config.node_id);
  }
  return out;
}

void check_shared_bus(Findings& findings, const LineSection& line, const LineSection& other) {
  for (const unsigned id : node_ids(line.plan.config)) {
    const std::vector<unsigned> theirs = node_ids(other.plan.config);
    if (std::find(theirs.begin(), theirs.end(), id) != theirs.end()) {
      findings.error(line.interface_place, "node-ID " + std::to_string(id) + " is that of line \"" +
                                               other.plan.config.name + "\" on the same bus " +
                                               line.plan.interface.uri +
                                               ": give one of them another node_id");
    }
  }
}

void check_collisions(Findings& findings, const LineSection& line,
                      const std::vector<LineSection>& others) {
  for (const auto& other : others) {
    const auto of = " as line \"" + other.plan.config.name + "\"";
    if (other.plan.config.name == line.plan.config.name) {
      findings.error(line.place, "another line is called \"" + line.plan.config.name + "\"");
    }
    if (other.plan.config.network_id == line.plan.config.network_id) {
      findings.error(line.network_place,
                     "the same network_id " + std::to_string(line.plan.config.network_id) + of);
    }
    if (line.plan.interface.scheme == Scheme::socketcan &&
        other.plan.interface.uri == line.plan.interface.uri) {
      findings.error(line.interface_place, "the same interface " + line.plan.interface.uri + of);
    }
    if (shares_bus(line, other)) {
      check_shared_bus(findings, line, other);
    }
    if (line.plan.record && other.plan.record && !line.plan.record->file.empty() &&
        other.plan.record->file == line.plan.record->file) {
      findings.error(line.record_place, "recorded to the same file " + line.plan.record->file + of);
    }
  }
}

// Whether to read the line with that name. only: the name of the only line to read; empty = all.
bool is_wanted(const YAML::Node& line, const std::string& only) {
  if (only.empty()) {
    return true;
  }
  const YAML::Node name = line.IsMap() ? line["name"] : YAML::Node();
  return name.IsDefined() && name.IsScalar() && name.Scalar() == only;
}

void read_lines(Findings& findings, const YAML::Node& node, const RoutingSection& routing,
                const std::vector<ForwardSection>& forwards,
                const std::vector<SharedObjectSection>& shared, const std::string& only,
                Plant& plant) {
  std::vector<LineSection> sections;
  std::uint16_t place = 0;
  for (const YAML::Node& element : elements(findings, node, "lines", kMostNodes)) {
    ++place;
    if (!is_wanted(element, only)) {
      continue;
    }
    const std::size_t before = findings.errors();
    LineSection section = read_line(findings, element);
    if (section.plan.config.network_id == 0) {
      section.plan.config.network_id = place;
    }
    check_executor(findings, section, plant);
    if (!section.history.entries.empty() && !plant.journal) {
      findings.error(section.history.place,
                     "history needs the journal that stores it: journal: {file: ...}");
    }
    check_clients(findings, section, plant);
    const std::string files = findings.pop_sources();
    check_collisions(findings, section, sections);
    check_ros2(findings, section, sections, plant);
    if (findings.errors() == before) {
      resolve_outputs(findings, section);
      // Only for documents without errors: an invalid one may expand aliases without end.
      section.plan.source = source_of(element, section.plan, files);
    }
    sections.push_back(std::move(section));
  }
  if (node.IsSequence() && place == 0) {
    findings.error(place_of(node), "there is no line in lines");
  }
  if (only.empty()) {
    resolve_routing(findings, routing, plant, sections);
  }
  if (!findings.failed() && only.empty()) {
    JoinedLines joined(findings, sections, plant.bindings);
    resolve_bindings(findings, joined);
    resolve_shared_objects(findings, shared, joined);
    resolve_forwards(findings, plant, forwards, joined);
    joined.finish();
    resolve_own_values(findings, sections);
  }
  for (auto& section : sections) {
    section.plan.source += executor_source(section.plan, plant);
    plant.lines.push_back(std::move(section.plan));
  }
}

void read_document(Findings& findings, const YAML::Node& root, const std::string& only,
                   Plant& plant) {
  Section section(findings, root, "the configuration");
  section.number(section.require("schema"), 1, 1);
  read_gateway(findings, section.find("gateway"), plant);
  read_dds(findings, section.find("dds"), plant);
  plant.journal = read_journal(findings, section.find("journal"));
  read_executors(findings, section.find("executors"), plant);
  const auto forwards = read_forwards(findings, section.find("forward"));
  const auto shared = read_shared_objects(findings, section.find("shared_objects"));
  const RoutingSection routing =
      read_routing(findings, section.find("routing"), section.find("routes"));
  read_lines(findings, section.require("lines"), routing, forwards, shared, only, plant);
  section.done();
}

}  // namespace

std::string_view name(LogLevel level) {
  switch (level) {
    case LogLevel::trace:
      return "trace";
    case LogLevel::debug:
      return "debug";
    case LogLevel::info:
      return "info";
    case LogLevel::warning:
      return "warning";
    case LogLevel::error:
      return "error";
    case LogLevel::off:
      break;
  }
  return "off";
}

std::optional<LogLevel> parse_log_level(std::string_view text) {
  for (const auto level : {LogLevel::trace, LogLevel::debug, LogLevel::info, LogLevel::warning,
                           LogLevel::error, LogLevel::off}) {
    if (text == name(level)) {
      return level;
    }
  }
  return std::nullopt;
}

std::string_view name(Access access) {
  switch (access) {
    case Access::off:
      return "off";
    case Access::read:
      return "read";
    case Access::all:
      break;
  }
  return "all";
}

std::string_view name(Publish::Rule rule) {
  switch (rule) {
    case Publish::Rule::on_change:
      return "on_change";
    case Publish::Rule::on_sync:
      return "on_sync";
    case Publish::Rule::period:
      break;
  }
  return "period";
}

bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= kMostOfName &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; });
}

bool check_name(Findings& findings, const std::string& name, Place place, std::string_view what) {
  const bool good = is_name(name);
  if (!good) {
    findings.error(place, "a " + std::string(what) +
                              " has 1 to 64 letters, digits, '-' and '_', not \"" + name + "\"");
  }
  return good;
}

namespace {

bool has_meaning_in_commands(const std::string& name) {
  const bool digits =
      std::ranges::all_of(name, [](unsigned char c) { return c >= '0' && c <= '9'; });
  return name == "all" || name == "own" || digits;
}

}  // namespace

bool check_line_name(Findings& findings, const std::string& name, Place place) {
  if (!check_name(findings, name, place, "name")) {
    return false;
  }
  const bool good = !has_meaning_in_commands(name) && !name.starts_with('-');
  if (!good) {
    findings.error(place, "a line cannot be called \"" + name +
                              "\", which has another meaning in commands: all, own, numbers "
                              "(network-IDs) and names that begin with '-' (options)");
  }
  return good;
}

bool is_node_name(const std::string& name) {
  return is_name(name) && !has_meaning_in_commands(name);
}

bool check_node_name(Findings& findings, const std::string& name, Place place) {
  if (!check_name(findings, name, place, "name")) {
    return false;
  }
  const bool good = is_node_name(name);
  if (!good) {
    findings.error(place, "a node cannot be called \"" + name +
                              "\", which has another meaning in commands: all, own and numbers");
  }
  return good;
}

namespace {

Loaded<Plant> read_of(const std::string& text, const std::string& file, const std::string& only) {
  Findings findings(file);
  Plant plant;
  plant.file = file;
  try {
    const YAML::Node root = load_document(findings, text);
    if (!findings.failed()) {
      read_document(findings, root, only, plant);
    }
  } catch (const YAML::Exception& e) {
    const bool known = !e.mark.is_null();
    findings.error(known ? Place{static_cast<std::uint32_t>(e.mark.line + 1),
                                 static_cast<std::uint32_t>(e.mark.column + 1)}
                         : Place{},
                   "this is not YAML: " + e.msg);
  }
  Loaded<Plant> loaded;
  if (!findings.failed()) {
    loaded.value = std::move(plant);
  }
  loaded.diagnostics = findings.take();
  return loaded;
}

}  // namespace

Loaded<Plant> read(const std::string& text, const std::string& file) {
  return read_of(text, file, {});
}

Loaded<Plant> load_line(const std::string& path, const std::string& line) {
  std::string why;
  const auto text = whole_file(path, why);
  Loaded<Plant> loaded;
  if (text && !line.empty()) {
    loaded = read_of(*text, path, line);
  }
  const bool known =
      std::ranges::any_of(loaded.diagnostics,
                          [](const Diagnostic& one) { return one.severity == Severity::error; }) ||
      (loaded.value && !loaded.value->lines.empty());
  return known ? std::move(loaded) : load(path);
}

Loaded<Plant> load(const std::string& path) {
  std::string why;
  const auto text = whole_file(path, why);
  if (!text) {
    Loaded<Plant> loaded;
    loaded.diagnostics.push_back({Severity::error, path, 0, 0, std::move(why)});
    return loaded;
  }
  return read(*text, path);
}

}  // namespace linegate::config
