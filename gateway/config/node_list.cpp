// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/node_list.h"

#include <algorithm>
#include <filesystem>

#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

// `node_list: plant.cpj`, or {file: plant.cpj, network: 2}.
struct Reference {
  std::string file;
  std::uint16_t network = 1;
  Place place;
};

std::optional<Reference> read_reference(Findings& findings, const YAML::Node& node) {
  Reference out;
  out.place = place_of(node);
  if (node.IsScalar()) {
    out.file = node.Scalar();
    return out;
  }
  Section section(findings, node, "node_list");
  const auto file = section.text(section.require("file"));
  section.read_number("network", out.network, 1, 0xFFFF);
  section.done();
  if (!file) {
    return std::nullopt;
  }
  out.file = *file;
  return out;
}

class ListReader {
 public:
  ListReader(Findings& findings, const Reference& reference)
      : findings_(findings), reference_(reference) {
    const auto folder = std::filesystem::path(findings.file()).parent_path();
    path_ = (folder / reference.file).lexically_normal();
  }

  std::vector<line::NodeConfig> read() {
    std::vector<line::NodeConfig> out;
    const auto content = read_file(findings_, path_.string(), reference_.place);
    if (!content) {
      return out;
    }
    auto loaded = eds::read_node_list(*content, path_.string());
    findings_.add(std::move(loaded.diagnostics));
    if (!loaded.value) {
      findings_.error(reference_.place, "the list of nodes " + path_.string() + " has errors");
      return out;
    }
    const auto& networks = loaded.value->networks;
    const auto network =
        std::ranges::find(networks, reference_.network, &eds::ListedNetwork::number);
    if (network == networks.end()) {
      findings_.error(reference_.place,
                      path_.string() + " has no network " + std::to_string(reference_.network));
      return out;
    }
    for (const eds::ListedNode& node : network->nodes) {
      if (auto config = read_node(*network, node)) {
        out.push_back(*std::move(config));
      }
    }
    return out;
  }

 private:
  std::optional<line::NodeConfig> read_node(const eds::ListedNetwork& network,
                                            const eds::ListedNode& node) {
    if (node.dcf.empty()) {
      report(Severity::error, node, "node " + std::to_string(node.id) + " has no DCFName");
      return std::nullopt;
    }
    const auto path = (path_.parent_path() / network.folder / node.dcf).lexically_normal();
    auto device = load_device(findings_, path.string(), node.id, reference_.place);
    if (!device) {
      return std::nullopt;
    }
    line::NodeConfig out;
    out.id = node.id;
    out.name = node.name;
    if (!is_node_name(out.name)) {
      out.name = "node" + std::to_string(node.id);
      report(Severity::warning, node,
             "\"" + node.name + "\" cannot be the name of a node; " + out.name + " is used");
    }
    out.device = *std::move(device);
    return out;
  }

  void report(Severity severity, const eds::ListedNode& node, std::string text) {
    findings_.add({{severity, path_.string(), node.line, 0, std::move(text)}});
  }

  Findings& findings_;
  const Reference& reference_;
  std::filesystem::path path_;
};

}  // namespace

std::vector<line::NodeConfig> read_node_list(Findings& findings, const YAML::Node& node) {
  if (!node.IsDefined()) {
    return {};
  }
  const auto reference = read_reference(findings, node);
  return reference ? ListReader(findings, *reference).read() : std::vector<line::NodeConfig>{};
}

}  // namespace linegate::config
