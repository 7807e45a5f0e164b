// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan_files.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "bridges/can/interface_uri.h"
#include "bridges/sim/device.h"
#include "gateway/config/found_nodes.h"
#include "gateway/config/plant.h"
#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/eds/writer.h"
#include "stack/line/line.h"
#include "stack/line/pdo_checks.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::gateway {
namespace {

namespace fs = std::filesystem;

// The settings that are written to the node when it boots.
void emit_error_control(YAML::Emitter& out, const line::NodeConfig& node) {
  const auto text = [](Duration time) {
    return fmt::format("{}ms", std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
  };
  if (node.heartbeat != Duration::zero()) {
    out << YAML::Key << "heartbeat" << YAML::Value << text(node.heartbeat);
  } else if (node.guard_time != Duration::zero()) {
    out << YAML::Key << "guarding" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "time" << YAML::Value << text(node.guard_time) << YAML::Key << "factor" << YAML::Value
        << int{node.life_time_factor} << YAML::EndMap;
  }
}

void emit_objects(YAML::Emitter& out, const line::NodeConfig& node) {
  if (node.objects.empty()) {
    return;
  }
  out << YAML::Key << "objects" << YAML::Value << YAML::BeginMap;
  for (const line::ObjectValue& object : node.objects) {
    out << YAML::Key << config::format_address(object.address) << YAML::Value
        << load_le(std::span<const std::byte>(object.data));
  }
  out << YAML::EndMap;
}

constexpr Duration kHeartbeat = std::chrono::milliseconds(500);
constexpr Duration kGuardTime = std::chrono::milliseconds(500);
constexpr std::uint8_t kLifeTimeFactor = 3;
constexpr Duration kSyncPeriod = std::chrono::milliseconds(100);

// Selects error control for the node, without which the loss of the device is not detected. Returns
// false if the device supports neither heartbeat nor node guarding.
bool set_error_control(const scan::ScannedNode& found, line::NodeConfig& node) {
  if (node.heartbeat != Duration::zero() || node.guard_time != Duration::zero()) {
    return true;
  }
  if (found.number({od::objects::kProducerHeartbeatTime, 0})) {
    node.heartbeat = kHeartbeat;
  } else if (found.number({od::objects::kGuardTime, 0}) &&
             found.number({od::objects::kLifeTimeFactor, 0})) {
    node.guard_time = kGuardTime;
    node.life_time_factor = kLifeTimeFactor;
  } else {
    return false;
  }
  return true;
}

// The SYNC period of the line, if it has one. Otherwise, if PDOs need a SYNC, the period in 1006h
// of a device, or kSyncPeriod.
Duration needed_sync(const ScannedLine& line, const std::vector<config::FoundNode>& nodes) {
  if (line.sync_period != Duration::zero()) {
    return line.sync_period;
  }
  line::LineConfig config;
  config.canopen_fd = line.canopen_fd;
  for (const config::FoundNode& node : nodes) {
    config.nodes.push_back(node.config);
  }
  if (!line::unsynchronised_pdos(config)) {
    return Duration::zero();
  }
  for (const scan::ScannedNode& node : line.nodes) {
    if (const auto period = node.number({od::objects::kSyncPeriod, 0}); period && *period >= 1000) {
      return std::chrono::microseconds(*period);
    }
  }
  return kSyncPeriod;
}

struct NodeFile {
  const line::NodeConfig* node;
  std::string file;
  std::string content;
  bool watched = true;
};

std::string bit_rate_text(std::uint32_t rate) {
  return rate % 1000 == 0 ? fmt::format("{}kbit", rate / 1000) : fmt::format("{}bit", rate);
}

// The profile of a simulated device with the same identity.
std::optional<std::string> profile_by_identity(const line::NodeConfig& node) {
  const auto number = [](const od::DeviceDescription& device, std::uint8_t sub) {
    const od::VariableDescription* const known =
        device.find(od::Address{od::objects::kIdentity, sub});
    return known == nullptr ? 0 : load_le(std::span<const std::byte>(known->value));
  };
  for (const std::string_view profile : sim::profiles()) {
    const auto file = eds::load(sim::eds_text(profile), sim::eds_name(profile), node.id);
    if (file.value && number(*file.value, 1) == number(node.device, 1) &&
        number(*file.value, 2) == number(node.device, 2)) {
      return std::string(profile);
    }
  }
  return std::nullopt;
}

// The devices of a line "simulated:" exist only if its configuration lists them.
void emit_simulated(YAML::Emitter& out, const std::vector<NodeFile>& files) {
  out << YAML::Key << "simulate" << YAML::Value << YAML::BeginSeq;
  for (const NodeFile& file : files) {
    if (const auto profile = profile_by_identity(*file.node)) {
      out << YAML::Flow << YAML::BeginMap << YAML::Key << "node" << YAML::Value
          << int{file.node->id} << YAML::Key << "profile" << YAML::Value << *profile
          << YAML::EndMap;
    }
  }
  out << YAML::EndSeq;
}

void emit_access(YAML::Emitter& out, const ScannedLine& line) {
  if (line.access.empty()) {
    return;
  }
  out << YAML::Key << "access" << YAML::Value;
  if (line.access == line.outputs_access) {
    out << line.access;
    return;
  }
  out << YAML::BeginMap << YAML::Key << "commands" << YAML::Value << line.access;
  if (!line.outputs_access.empty()) {
    out << YAML::Key << "outputs" << YAML::Value << line.outputs_access;
  }
  out << YAML::EndMap;
}

void emit_fd(YAML::Emitter& out, const ScannedLine& line) {
  if (!line.canopen_fd) {
    return;
  }
  out << YAML::Key << "canopen_fd" << YAML::Value << true;
  if (line.data_bit_rate != 0) {
    out << YAML::Key << "data_bit_rate" << YAML::Value << bit_rate_text(line.data_bit_rate);
  }
  if (line.usdo_abort != usdo::AbortForm::one_byte) {
    out << YAML::Key << "usdo_abort" << YAML::Value << std::string(usdo::name(line.usdo_abort));
  }
}

void emit_flying_master(YAML::Emitter& out, const ScannedLine& line) {
  if (line.flying_master) {
    out << YAML::Key << "flying_master" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "priority" << YAML::Value << int{*line.flying_master} << YAML::EndMap;
  }
}

void emit_sync(YAML::Emitter& out, Duration sync) {
  if (sync != Duration::zero()) {
    out << YAML::Key << "sync" << YAML::Value << config::format_duration(sync);
  }
}

std::string plant_text(const ScannedLine& line, Duration sync, const std::vector<NodeFile>& files) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "schema" << YAML::Value << 1;
  out << YAML::Key << "gateway" << YAML::Value << YAML::BeginMap << YAML::Key << "name"
      << YAML::Value << line.gateway << YAML::EndMap;
  if (line.dds_domain != 0) {
    out << YAML::Key << "dds" << YAML::Value << YAML::BeginMap << YAML::Key << "domain"
        << YAML::Value << line.dds_domain << YAML::EndMap;
  }
  out << YAML::Key << "lines" << YAML::Value << YAML::BeginSeq << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << line.name;
  out << YAML::Key << "interface" << YAML::Value << YAML::DoubleQuoted << line.interface_uri;
  if (line.bit_rate != 0) {
    out << YAML::Key << "bit_rate" << YAML::Value << bit_rate_text(line.bit_rate);
  }
  emit_fd(out, line);
  out << YAML::Key << "network_id" << YAML::Value << line.network_id;
  out << YAML::Key << "node_id" << YAML::Value << int{line.node_id};
  emit_flying_master(out, line);
  emit_sync(out, sync);
  emit_access(out, line);
  out << YAML::Key << "nodes" << YAML::Value << YAML::BeginSeq;
  for (const NodeFile& file : files) {
    out << YAML::BeginMap << YAML::Key << "id" << YAML::Value << int{file.node->id};
    out << YAML::Key << "name" << YAML::Value << file.node->name;
    out << YAML::Key << "dcf" << YAML::Value << file.file;
    emit_error_control(out, *file.node);
    if (!file.watched) {
      out << YAML::Comment("no heartbeat, no guarding: the loss of this node is not detected");
    }
    emit_objects(out, *file.node);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
  if (line.interface_uri.starts_with("simulated:")) {
    emit_simulated(out, files);
  }
  out << YAML::EndMap << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

NodeFile file_of(const ScannedLine& line, const config::FoundNode& node) {
  eds::DataSheet sheet = eds::sheet_of(node.config.device, true);
  sheet.file.last_eds = node.sheet;
  sheet.file.file_name = fmt::format("{}-{}.dcf", line.name, node.config.id);
  sheet.file.description =
      fmt::format("Node {} of line {}, as a scan found it", node.config.id, line.name);
  return {&node.config, sheet.file.file_name, eds::write_dcf(sheet)};
}

bool write_file(const fs::path& path, const std::string& content, ScanFiles& out) {
  std::error_code ignored;  // writing fails then, too
  if (fs::exists(path, ignored)) {
    out.error = fmt::format("{} exists, it is not overwritten", path.string());
    return false;
  }
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) {
    out.error = fmt::format("{} could not be written", path.string());
    return false;
  }
  out.written.push_back(path.string());
  return true;
}

// Describes the first difference as a clause.
std::string difference(const image::Layout& written, const image::Layout& running) {
  if (written.entries.size() != running.entries.size()) {
    return fmt::format("it has {} entries, not {}: other PDOs are mapped or enabled",
                       written.entries.size(), running.entries.size());
  }
  for (std::size_t i = 0; i < written.entries.size(); ++i) {
    const image::Entry& here = written.entries[i];
    const image::Entry& there = running.entries[i];
    const std::string which =
        fmt::format("entry {}, {} of node {}, ", i, od::to_text({here.index, here.sub}), here.node);
    if (std::tie(here.node, here.index, here.sub) != std::tie(there.node, there.index, there.sub)) {
      return fmt::format("{}is {} of node {} there", which, od::to_text({there.index, there.sub}),
                         there.node);
    }
    if (here.type != there.type) {
      return fmt::format("{}is {}, not {}", which, od::name(here.type), od::name(there.type));
    }
  }
  return "PDOs have other numbers, or the device files another profile or product code";
}

// Adds a note for each direction with another layout_id, by which applications identify an image.
void compare_layouts(const ScannedLine& line, ScanFiles& out) {
  const auto loaded = config::load(out.written.front());
  if (!loaded.value) {
    return;  // linegate check reports the reason
  }
  const auto made = line::Line::make(loaded.value->lines.front().config);
  if (!made.value) {
    return;
  }
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    const auto& running = line.layouts.at(static_cast<std::size_t>(direction));
    const image::Layout& written = (*made.value)->layout(direction);
    if (running && !running->entries.empty() && running->id != written.id) {
      out.notes.push_back(fmt::format(
          "the layout_id of the {} is {:016X}, that of the running line {:016X}: {}",
          image::name(direction), written.id, running->id, difference(written, *running)));
    }
  }
}

}  // namespace

ScanFiles write_scan(const ScannedLine& line, const std::string& folder,
                     const std::string& eds_folder) {
  ScanFiles out;
  if (!config::is_name(line.name)) {  // received from the network and used as a file name
    out.error = fmt::format("'{}' is not a name that a plant.yaml can have for a line", line.name);
    return out;
  }
  const std::string wrong = line.interface_uri == "simulated:"
                                ? std::string()
                                : can_bridge::parse_uri(line.interface_uri).error;
  if (!wrong.empty()) {
    out.error = fmt::format("'{}' is not an interface that a plant.yaml can have: {}",
                            line.interface_uri, wrong);
    return out;
  }
  line::LineConfig kind;
  kind.canopen_fd = line.canopen_fd;
  config::FoundNodes found = config::found_nodes(line.nodes, eds_folder, line::longest_pdo(kind));
  out.notes = std::move(found.notes);
  out.error = std::move(found.error);
  if (!out.error.empty()) {
    return out;
  }
  if (line.flying_master) {
    out.notes.push_back(
        "flying_master is written with its priority alone: its times, and the "
        "heartbeat of the line, have to be copied from the other masters");
  }
  std::vector<NodeFile> files;
  for (config::FoundNode& node : found.nodes) {
    const auto scanned = std::ranges::find(line.nodes, node.config.id, &scan::ScannedNode::id);
    const bool watched = set_error_control(*scanned, node.config);
    files.push_back(file_of(line, node));
    files.back().watched = watched;
    if (!watched) {
      out.notes.push_back(
          fmt::format("node {}: has neither heartbeat nor guarding, its loss is not "
                      "detected",
                      node.config.id));
    }
  }
  std::error_code failed;
  fs::create_directories(folder, failed);
  const fs::path base(folder);
  out.ok =
      write_file(base / "plant.yaml", plant_text(line, needed_sync(line, found.nodes), files), out);
  for (const NodeFile& file : files) {
    out.ok = out.ok && write_file(base / file.file, file.content, out);
  }
  if (out.ok) {
    compare_layouts(line, out);
  }
  return out;
}

}  // namespace linegate::gateway
