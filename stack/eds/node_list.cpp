// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/node_list.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <utility>

#include "stack/eds/fields.h"
#include "stack/eds/text.h"

namespace linegate::eds {
namespace {

constexpr std::uint8_t kHighestListedId = 127;
constexpr std::string_view kTopology = "topology";

// "node5dcfname": the number, and the rest.
struct NodeKey {
  unsigned id = 0;
  std::string what;
};

bool parse_key(std::string_view key, NodeKey& out) {
  const std::string name = lower(key);
  if (!name.starts_with("node")) {
    return false;
  }
  const char* end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data() + 4, end, out.id);
  out.what.assign(stop, end);
  return error == std::errc() && !out.what.empty();
}

class NetworkReader {
 public:
  NetworkReader(const Section& section, Report& report)
      : section_(section), report_(report), fields_(section, report) {}

  ListedNetwork read() {
    ListedNetwork out;
    out.line = section_.place.line;
    out.name = fields_.text("NetName");
    out.reference = fields_.text("NetRefd");
    out.folder = fields_.text("EDSBaseName");
    for (const Entry& entry : section_.entries) {
      read_entry(entry);
    }
    for (auto& [id, node] : nodes_) {
      if (node.present) {
        out.nodes.push_back(std::move(node.node));
      }
    }
    check_count(out);
    return out;
  }

 private:
  struct Node {
    ListedNode node;
    bool present = false;
  };

  void read_entry(const Entry& entry) {
    for (const std::string_view known : {"NetName", "NetRefd", "EDSBaseName", "Nodes"}) {
      if (equal_ignoring_case(entry.key, known)) {
        return;
      }
    }
    NodeKey key;
    if (!parse_key(entry.key, key)) {
      report_.warning(entry.key_place, "key " + quote(entry.key) + " is not known; ignored");
      return;
    }
    if (key.id == 0 || key.id > kHighestListedId) {
      report_.error(entry.key_place, "node-ID " + std::to_string(key.id) + " is not in 1 to 127");
      return;
    }
    Node& node = nodes_[static_cast<std::uint8_t>(key.id)];
    node.node.id = static_cast<std::uint8_t>(key.id);
    if (key.what == "present") {
      node.present = fields_.number_of(entry, 1, Severity::error).value_or(0) == 1;
      node.node.line = entry.key_place.line;
    } else if (key.what == "name") {
      node.node.name = to_utf8(entry.value);
    } else if (key.what == "refd") {
      node.node.reference = to_utf8(entry.value);
    } else if (key.what == "dcfname") {
      node.node.dcf = to_utf8(entry.value);
    } else {
      report_.warning(entry.key_place, "key " + quote(entry.key) + " is not known; ignored");
    }
  }

  void check_count(const ListedNetwork& network) {
    const auto count = fields_.number("Nodes", kHighestListedId);
    if (count && *count != network.nodes.size()) {
      report_.warning(fields_.find("Nodes")->value_place,
                      "Nodes is " + std::to_string(*count) + ", but " +
                          std::to_string(network.nodes.size()) + " are present");
    }
  }

  const Section& section_;
  Report& report_;
  Fields fields_;
  std::map<std::uint8_t, Node> nodes_;
};

// 1 for "topology", 2 for "topology2"; 0 for other sections.
unsigned network_number(std::string_view section) {
  if (!section.starts_with(kTopology)) {
    return 0;
  }
  const std::string_view digits = section.substr(kTopology.size());
  unsigned number = digits.empty() ? 1 : 0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  return digits.empty() || (error == std::errc() && stop == end && number <= 0xFFFF) ? number : 0;
}

}  // namespace

Loaded<NodeList> read_node_list(std::string_view text, std::string_view file_name) {
  Report report(file_name);
  const Ini ini = Ini::parse(text, report);
  NodeList list;
  for (const Section& section : ini.sections()) {
    const unsigned number = network_number(comparable(section.name));
    if (number == 0) {
      report.note(section.place, "section " + quote(section.name) + " is not known; ignored");
      continue;
    }
    list.networks.push_back(NetworkReader(section, report).read());
    list.networks.back().number = static_cast<std::uint16_t>(number);
  }
  std::stable_sort(list.networks.begin(), list.networks.end(),
                   [](const auto& a, const auto& b) { return a.number < b.number; });
  if (list.networks.empty() && !report.has_errors()) {
    report.error({}, "there is no section [Topology]; this is no list of nodes");
  }
  Loaded<NodeList> loaded;
  if (!report.has_errors()) {
    loaded.value = std::move(list);
  }
  loaded.diagnostics = report.take();
  return loaded;
}

}  // namespace linegate::eds
