// SPDX-License-Identifier: Apache-2.0
// The result of a verification or of an application of configurations, as a table and as JSON.
#include <algorithm>

#include <nlohmann/json.hpp>

#include "bridges/console/configuration.h"
#include "bridges/console/object_text.h"
#include "bridges/console/one_line.h"
#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::console {
namespace {

using manager::Difference;
using manager::NodeReport;

std::string abort_of(AbortCode code) {
  return std::string(describe(code)) + " (" + format_hex(static_cast<std::uint32_t>(code), 8) + ")";
}

// As a number if possible, else as bytes.
std::string shown_value(std::span<const std::byte> value) {
  constexpr std::size_t kShown = 16;
  if (!value.empty() && value.size() <= 8) {
    return format_hex(load_le(value), 2 * value.size()) + "h";
  }
  std::string out;
  for (const std::byte byte : value.first(std::min(kShown, value.size()))) {
    out += format_hex(std::to_integer<unsigned>(byte), 2) + " ";
  }
  return out + "(" + std::to_string(value.size()) + " bytes)";
}

std::string bytes_of(std::span<const std::byte> value) {
  std::string out;
  for (const std::byte byte : value) {
    out += format_hex(std::to_integer<unsigned>(byte), 2);
  }
  return out;
}

std::string found_of(const Difference& difference) {
  return difference.abort == AbortCode::none ? shown_value(difference.found)
                                             : abort_of(difference.abort);
}

// The result of the boot process that was to configure the node, in the words of `linegate boot`.
std::string words_of_boot(const NodeReport& node, const BootFindings& findings) {
  const auto found = findings.find(node.node);
  return manager::describe_boot(node.boot,
                                found == findings.end() ? manager::BootFinding{} : found->second);
}

void add_boot(const NodeReport& node, const BootFindings& findings, nlohmann::ordered_json& to) {
  to["boot_text"] = words_of_boot(node, findings);
  const auto found = findings.find(node.node);
  if (found != findings.end() && found->second.kind == manager::BootFinding::Kind::value) {
    to["boot_object"] = od::to_text(found->second.object);
    to["boot_expected"] = found->second.expected;
    to["boot_found"] = found->second.found;
  }
}

Note note_of(ConfigAction action, const NodeReport& node, const BootFindings& findings) {
  const std::string who = "node " + std::to_string(node.node) + ": ";
  if (node.good()) {
    return {who + (action == ConfigAction::verify ? "has its configuration" : "configured"),
            Style::good};
  }
  if (node.boot != manager::kBooted) {
    return {who + words_of_boot(node, findings) + " (" + node.boot + ')', Style::error};
  }
  if (node.end != AbortCode::none && node.differences.empty()) {
    return {who + "not read to its end: " + abort_of(node.end), Style::error};
  }
  return {who + (action == ConfigAction::verify ? "differs in " : "did not take ") +
              std::to_string(node.differences.size()) +
              (node.differences.size() == 1 ? " object" : " objects"),
          Style::error};
}

}  // namespace

Table configuration_table(const LineId& id, ConfigAction action,
                          const std::vector<NodeReport>& nodes, const BootFindings& findings) {
  Table out{{{"NODE", true}, {"OBJECT"}, {"EXPECTED", true}, {"FOUND"}}, {}, {}};
  for (const NodeReport& node : nodes) {
    for (const Difference& difference : node.differences) {
      out.rows.push_back({{id, node.node},
                          {{std::to_string(node.node), node.node},
                           {od::to_text(difference.object), {}},
                           {shown_value(difference.expected), {}},
                           {found_of(difference), {}}},
                          Style::error});
    }
    out.notes.push_back(note_of(action, node, findings));
  }
  if (nodes.empty()) {
    out.notes.push_back({"no node is configured on this line", Style::warning});
  }
  return out;
}

std::string configuration_json(const LineId& id, ConfigAction action,
                               const std::vector<NodeReport>& nodes, const BootFindings& findings) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const NodeReport& node : nodes) {
    nlohmann::ordered_json differences = nlohmann::ordered_json::array();
    for (const Difference& difference : node.differences) {
      nlohmann::ordered_json one{{"object", od::to_text(difference.object)},
                                 {"expected", bytes_of(difference.expected)}};
      if (difference.abort == AbortCode::none) {
        one["found"] = bytes_of(difference.found);
      } else {
        one["abort"] = static_cast<std::uint32_t>(difference.abort);
      }
      differences.push_back(std::move(one));
    }
    nlohmann::ordered_json one{{"node", node.node}, {"ok", node.good()}};
    one["boot"] = node.boot == manager::kBooted ? std::string() : std::string(1, node.boot);
    if (node.boot != manager::kBooted) {
      add_boot(node, findings, one);
    }
    one["abort"] = static_cast<std::uint32_t>(node.end);
    one["differences"] = std::move(differences);
    list.push_back(std::move(one));
  }
  return one_line(
      nlohmann::ordered_json{{"gateway", id.gateway},
                             {"line", id.line},
                             {"action", action == ConfigAction::verify ? "verify" : "apply"},
                             {"nodes", list}});
}

}  // namespace linegate::console
