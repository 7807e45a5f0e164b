#include "gateway/scan_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "bridges/sim/device.h"
#include "stack/eds/reader.h"
#include "stack/eds/writer.h"
#include "stack/scan/describe.h"
#include "stack/scan/merge.h"

namespace linegate::gateway {
namespace {

namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Sheet {
  std::string name;
  std::string text;
};

std::vector<Sheet> sheets_in(const std::string& folder, std::string& error) {
  std::vector<Sheet> out;
  if (folder.empty()) {
    return out;
  }
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    std::string extension = at->path().extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == ".eds") {
      out.push_back({at->path().filename().string(), read_file(at->path())});
    }
  }
  if (failed) {
    error = fmt::format("{}: {}", folder, failed.message());
  }
  std::ranges::sort(out, {}, &Sheet::name);
  return out;
}

struct Described {
  od::DeviceDescription device;
  std::string sheet;  // the EDS it was made with, empty = none
};

Described describe_node(const scan::ScannedNode& node, const std::vector<Sheet>& sheets,
                        std::vector<std::string>& notes) {
  for (const Sheet& sheet : sheets) {
    auto loaded = eds::load(sheet.text, sheet.name, node.id);
    if (loaded.value && scan::matches(*loaded.value, node)) {
      notes.push_back(fmt::format("node {}: names and types of {}", node.id, sheet.name));
      return {scan::merge(*std::move(loaded.value), node), sheet.name};
    }
  }
  if (!sheets.empty()) {
    notes.push_back(
        fmt::format("node {}: no EDS of its identity, types are known by length alone", node.id));
  }
  return {scan::describe(node), {}};
}

void emit_error_control(YAML::Emitter& out, const scan::ScannedNode& node) {
  const auto heartbeat = node.number({0x1017, 0}).value_or(0);
  const auto guard = node.number({0x100C, 0}).value_or(0);
  const auto factor = node.number({0x100D, 0}).value_or(0);
  if (heartbeat != 0) {
    out << YAML::Key << "heartbeat" << YAML::Value << fmt::format("{}ms", heartbeat);
  } else if (guard != 0 && factor != 0) {
    out << YAML::Key << "guarding" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "time" << YAML::Value << fmt::format("{}ms", guard) << YAML::Key << "factor"
        << YAML::Value << factor << YAML::EndMap;
  }
}

struct NodeFile {
  const scan::ScannedNode* node;
  std::string file;
  std::string content;
};

std::string bit_rate_text(std::uint32_t rate) {
  return rate % 1000 == 0 ? fmt::format("{}kbit", rate / 1000) : fmt::format("{}bit", rate);
}

// The profile of a simulated device, by its identity.
std::optional<std::string> profile_of(const scan::ScannedNode& node) {
  for (const std::string_view profile : sim::profiles()) {
    const auto file = eds::load(sim::eds_text(profile), sim::eds_name(profile), node.id);
    if (file.value && scan::matches(*file.value, node)) {
      return std::string(profile);
    }
  }
  return std::nullopt;
}

// Devices of a line "simulated:" are there because its configuration says so.
void emit_simulated(YAML::Emitter& out, const std::vector<NodeFile>& files) {
  out << YAML::Key << "simulate" << YAML::Value << YAML::BeginSeq;
  for (const NodeFile& file : files) {
    if (const auto profile = profile_of(*file.node)) {
      out << YAML::Flow << YAML::BeginMap << YAML::Key << "node" << YAML::Value
          << int{file.node->id} << YAML::Key << "profile" << YAML::Value << *profile
          << YAML::EndMap;
    }
  }
  out << YAML::EndSeq;
}

std::string plant_text(const ScannedLine& line, const std::vector<NodeFile>& files) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "schema" << YAML::Value << 1;
  out << YAML::Key << "gateway" << YAML::Value << YAML::BeginMap << YAML::Key << "name"
      << YAML::Value << line.gateway << YAML::EndMap;
  out << YAML::Key << "lines" << YAML::Value << YAML::BeginSeq << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << line.name;
  out << YAML::Key << "interface" << YAML::Value << YAML::DoubleQuoted << line.interface_uri;
  if (line.bit_rate != 0) {
    out << YAML::Key << "bit_rate" << YAML::Value << bit_rate_text(line.bit_rate);
  }
  out << YAML::Key << "network_id" << YAML::Value << line.network_id;
  out << YAML::Key << "node_id" << YAML::Value << int{line.node_id};
  out << YAML::Key << "nodes" << YAML::Value << YAML::BeginSeq;
  for (const NodeFile& file : files) {
    out << YAML::BeginMap << YAML::Key << "id" << YAML::Value << int{file.node->id};
    out << YAML::Key << "dcf" << YAML::Value << file.file;
    emit_error_control(out, *file.node);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
  if (line.interface_uri.starts_with("simulated:")) {
    emit_simulated(out, files);
  }
  out << YAML::EndMap << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

NodeFile file_of(const ScannedLine& line, const scan::ScannedNode& node, Described described) {
  eds::DataSheet sheet = eds::sheet_of(std::move(described.device), true);
  sheet.file.last_eds = described.sheet;
  sheet.file.file_name = fmt::format("{}-{}.dcf", line.name, node.id);
  sheet.file.description =
      fmt::format("Node {} of line {}, as a scan found it", node.id, line.name);
  return {&node, sheet.file.file_name, eds::write_dcf(sheet)};
}

bool write_file(const fs::path& path, const std::string& content, ScanFiles& out) {
  if (fs::exists(path)) {
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

}  // namespace

ScanFiles write_scan(const ScannedLine& line, const std::string& folder,
                     const std::string& eds_folder) {
  ScanFiles out;
  const std::vector<Sheet> sheets = sheets_in(eds_folder, out.error);
  if (!out.error.empty()) {
    return out;
  }
  std::vector<NodeFile> files;
  for (const scan::ScannedNode& node : line.nodes) {
    if (node.end == AbortCode::none) {
      files.push_back(file_of(line, node, describe_node(node, sheets, out.notes)));
    } else {
      out.notes.push_back(fmt::format("node {} is left out: it was not read to the end", node.id));
    }
  }
  std::error_code failed;
  fs::create_directories(folder, failed);
  const fs::path base(folder);
  out.ok = write_file(base / "plant.yaml", plant_text(line, files), out);
  for (const NodeFile& file : files) {
    out.ok = out.ok && write_file(base / file.file, file.content, out);
  }
  return out;
}

}  // namespace linegate::gateway
