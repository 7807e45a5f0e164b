// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

constexpr Duration kLongestHeartbeat = milliseconds(65'535);  // 1016h, 1017h: 16 bits of ms

void read_heartbeat(Section& section, line::NodeConfig& config) {
  const YAML::Node node = section.find("heartbeat");
  if (!node.IsDefined()) {
    return;
  }
  if (!node.IsMap()) {
    section.read_multiple("heartbeat", config.heartbeat, milliseconds(1), kLongestHeartbeat);
    return;
  }
  Section from(section.findings(), node, "heartbeat");
  from.read_multiple("producer", config.heartbeat, milliseconds(1), kLongestHeartbeat);
  from.read_multiple("consumer", config.heartbeat_consumer, milliseconds(1), kLongestHeartbeat);
  from.done();
  if (config.heartbeat_consumer != Duration::zero() &&
      config.heartbeat_consumer <= config.heartbeat) {
    section.findings().error(place_of(node), "the consumer time " +
                                                 format_duration(config.heartbeat_consumer) +
                                                 " must be longer than the producer time " +
                                                 format_duration(config.heartbeat));
  }
}

void read_guarding(Section& section, line::NodeConfig& config) {
  const YAML::Node node = section.find("guarding");
  if (!node.IsDefined()) {
    return;
  }
  Section from(section.findings(), node, "guarding");
  (void)from.require("time");
  from.read_multiple("time", config.guard_time, milliseconds(1), kLongestHeartbeat);
  if (const auto factor = from.number(from.require("factor"), 1, 255)) {
    config.life_time_factor = static_cast<std::uint8_t>(*factor);
  }
  from.done();
  if (config.heartbeat != Duration::zero() || config.heartbeat_consumer != Duration::zero()) {
    section.findings().error(place_of(node),
                             "a node has either the key \"heartbeat\" or the key "
                             "\"guarding\"");
  }
}

// `check: [vendor, product, revision-major]`, or `all` or `none`.
void read_identity_check(Section& section, line::IdentityScope& scope) {
  const YAML::Node list = section.find("check");
  const YAML::Node all = section.find("check_identity");
  if (list.IsDefined() && all.IsDefined()) {
    section.findings().error(place_of(list),
                             "a node has either the key \"check\" or the key \"check_identity\"");
  }
  bool compared = true;
  section.read("check_identity", compared);
  if (!list.IsDefined() && compared) {
    return;
  }
  scope = {.device_type = false, .vendor = false, .product = false, .revision = false};
  enum class Part : std::uint8_t { none, device_type, vendor, product, revision, major };
  for (const YAML::Node& element : elements(section.findings(), list, "check")) {
    Part part = Part::none;
    section.choose<Part>(element, part,
                         {{"device-type", Part::device_type},
                          {"vendor", Part::vendor},
                          {"product", Part::product},
                          {"revision", Part::revision},
                          {"revision-major", Part::major}});
    scope.device_type = scope.device_type || part == Part::device_type;
    scope.vendor = scope.vendor || part == Part::vendor;
    scope.product = scope.product || part == Part::product;
    scope.revision_major_alone = part == Part::major
                                     ? !scope.revision
                                     : scope.revision_major_alone && part != Part::revision;
    scope.revision = scope.revision || part == Part::revision || part == Part::major;
  }
}

}  // namespace

bool read_device_file(Section& section, line::NodeConfig& config, std::string_view what) {
  Findings& findings = section.findings();
  const YAML::Node eds = section.find("eds");
  const YAML::Node dcf = section.find("dcf");
  if (eds.IsDefined() == dcf.IsDefined()) {
    if (section.valid()) {
      findings.error(
          section.place(),
          std::string(what) + (eds.IsDefined() ? " has either the key \"eds\" or the key \"dcf\""
                                               : " needs the key \"eds\" (or \"dcf\")"));
    }
    return false;
  }
  const YAML::Node node = eds.IsDefined() ? eds : dcf;
  const auto text = section.text(node);
  if (!text || config.id == 0) {
    return false;
  }
  const auto path =
      (std::filesystem::path(findings.file()).parent_path() / *text).lexically_normal();
  auto device = load_device(findings, path.string(), config.id, place_of(node));
  if (!device) {
    return false;
  }
  config.device = *std::move(device);
  return true;
}

line::NodeConfig read_node(Findings& findings, const YAML::Node& node, std::size_t longest_pdo) {
  line::NodeConfig config;
  Section section(findings, node, "a node");
  if (const auto id = section.number(section.require("id"), 1, 127)) {
    config.id = static_cast<std::uint8_t>(*id);
  }
  config.name = "node" + std::to_string(config.id);
  const YAML::Node name = section.find("name");
  if (auto text = section.text(name)) {
    check_node_name(findings, *text, place_of(name));
    config.name = std::move(*text);
  }
  read_boot(section, config);
  read_identity_check(section, config.check);
  if (const auto serial = section.number(section.find("serial"), 0, 0xFFFF'FFFF)) {
    config.serial = static_cast<std::uint32_t>(*serial);
  }
  read_heartbeat(section, config);
  read_guarding(section, config);
  section.read_multiple("pdo_deadline", config.pdo_deadline, milliseconds(1), milliseconds(0xFFFF));
  const YAML::Node objects = section.find("objects");
  const YAML::Node pdos = section.find("pdos");
  const YAML::Node srdos = section.find("srdo");
  const YAML::Node values = section.find("values");
  const bool has_device = read_device_file(section, config, "a node");
  if (has_device && !section.find("concise_dcf").IsDefined()) {
    read_pdos(findings, pdos, config, longest_pdo);
    const std::set<std::uint8_t> written = read_srdos(findings, srdos, config);
    read_objects(findings, objects, config);
    sign_srdos(written, config);
  }
  read_configuration(section, has_device, config);
  if (has_device) {
    read_values(findings, values, config.device);
  }
  section.done();
  return config;
}

}  // namespace linegate::config
