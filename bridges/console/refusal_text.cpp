// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/refusal_text.h"

#include <map>
#include <ostream>
#include <set>

#include "bridges/console/lookup.h"
#include "bridges/console/table.h"

namespace linegate::console {
namespace {

const Area& outputs_of(const Line& line) {
  return line.areas[static_cast<std::size_t>(image::Direction::outputs)];
}

template <class Numbers, class Words>
std::string list_of(const Numbers& numbers, Words words) {
  std::string out;
  for (const auto& each : numbers) {
    out += (out.empty() ? "" : ", ") + words(each);
  }
  return out.empty() ? "none" : out;
}

std::string nodes_text(const Line& line) {
  std::map<std::uint8_t, std::string> names;
  for (const auto& [id, node] : line.nodes) {
    if (node.state.configured) {
      names[id] = node.name;
    }
  }
  return list_of(names, [](const auto& node) {
    return std::to_string(node.first) +
           (node.second.empty() ? "" : " (" + printable(node.second) + ')');
  });
}

std::string pdos_text(const std::set<std::uint16_t>& numbers) {
  return list_of(numbers, [](std::uint16_t number) { return std::to_string(number); });
}

// The RPDOs of that node in the outputs.
std::set<std::uint16_t> rpdos_of(const image::Layout& outputs, std::uint8_t node) {
  std::set<std::uint16_t> out;
  for (const image::Entry& entry : outputs.entries) {
    if (entry.node == node && entry.remote_pdo != 0) {
      out.insert(entry.remote_pdo);
    }
  }
  return out;
}

std::set<std::uint16_t> tpdos_of(const image::Layout& outputs) {
  std::set<std::uint16_t> out;
  for (const image::Entry& entry : outputs.entries) {
    if (entry.local_pdo != 0) {
      out.insert(entry.local_pdo);
    }
  }
  return out;
}

// The gateway refused the request before the state that is known now.
constexpr const char* kWasNotOperational = " was not operational; now it is: repeat the command";

std::string no_such_pdo(const Line& line, const line::PdoTrigger& trigger) {
  if (line.view->state.role == line::Role::device) {
    return "device " + std::to_string(trigger.node) + " has no TPDO " +
           std::to_string(trigger.number);
  }
  if (!outputs_of(line).layout) {
    return {};
  }
  const image::Layout& outputs = *outputs_of(line).layout;
  const std::string name = printable(line.id.line);
  if (trigger.output_byte) {
    return "no PDO carries byte " + std::to_string(*trigger.output_byte) + " of the outputs of " +
           name + ", which have " + std::to_string(outputs.byte_size) + " bytes";
  }
  if (trigger.node == 0) {
    return name + " has no TPDO " + std::to_string(trigger.number) +
           "; the PDOs of its outputs: " + pdos_text(tpdos_of(outputs));
  }
  return name + " does not send to RPDO " + std::to_string(trigger.number) + " of node " +
         std::to_string(trigger.node) +
         "; to its RPDOs: " + pdos_text(rpdos_of(outputs, trigger.node));
}

std::string wrong_state(const Line& line, const line::PdoTrigger& trigger) {
  const bool devices = line.view->state.role == line::Role::device;
  const auto known = line.nodes.find(trigger.node);
  if (devices && known != line.nodes.end()) {
    if (known->second.state.state == nmt::State::operational)
      return "device " + std::to_string(trigger.node) + kWasNotOperational;
    return "device " + std::to_string(trigger.node) + " is " +
           std::string(nmt::name(known->second.state.state)) + ", not operational";
  }
  if (!devices && line.view->state.own_state != nmt::State::operational) {
    return "the own node of " + printable(line.id.line) + " is " +
           std::string(nmt::name(line.view->state.own_state)) + ", not operational";
  }
  return devices ? "" : "a value of the PDO was never written and has no default";
}

}  // namespace

std::string no_such_node(const Line& line, std::uint8_t node) {
  const auto known = line.nodes.find(node);
  if (known != line.nodes.end() && known->second.state.configured) {
    return {};
  }
  const bool own = line.view->state.node_id == node;
  return "node " + std::to_string(node) + (own ? " is the gateway's own on " : " is none of ") +
         printable(line.id.line) + "; its nodes: " + nodes_text(line);
}

void report_no_such_node(Context& context, Model& model, const Line& line, std::uint8_t node) {
  if (node == 0 || !know_nodes(context, model, line)) {
    return;
  }
  const std::string text = no_such_node(line, node);
  if (!text.empty()) {
    context.err << text << '\n';
  }
}

void add_node_state(Context& context, Model& model, const Line& line, std::uint8_t node,
                    Client::Answer& answer) {
  const bool names_group = !line::bytes_of(answer.reply.data).empty();
  if (answer.reply.error != line::to_error(line::Refusal::wrong_state) || names_group) {
    return;
  }
  (void)know_nodes(context, model, line);
  const auto known = line.nodes.find(node);
  if (known == line.nodes.end()) {
    answer.text += ": node " + std::to_string(node) + " is not operational";
    return;
  }
  const line::NodeState& seen = known->second.state;
  const bool present = seen.presence == manager::Presence::present;
  const std::string& name = known->second.name;
  answer.text +=
      ": node " + std::to_string(node) + (name.empty() ? "" : " (" + printable(name) + ')');
  if (present && seen.state == nmt::State::operational) {
    answer.text += kWasNotOperational;
    return;
  }
  answer.text += " is ";
  if (seen.presence != manager::Presence::unknown) {
    answer.text += present ? nmt::name(seen.state) : manager::name(seen.presence);
    answer.text += ", ";
  }
  answer.text += "not operational";
}

std::string trigger_refusal(Context& context, Model& model, const Line& line,
                            const line::PdoTrigger& trigger, line::Refusal refusal) {
  if (refusal != line::Refusal::unknown_entry && refusal != line::Refusal::wrong_state &&
      refusal != line::Refusal::bad_request) {
    return {};
  }
  if (trigger.node != 0) {
    (void)know_nodes(context, model, line);
    if (std::string none = no_such_node(line, trigger.node); !none.empty()) {
      return none;
    }
  }
  if (refusal == line::Refusal::unknown_entry) {
    (void)wait_until(context, model, [&] { return outputs_of(line).layout.has_value(); });
    return no_such_pdo(line, trigger);
  }
  if (refusal == line::Refusal::wrong_state) {
    return wrong_state(line, trigger);
  }
  const bool devices = line.view->state.role == line::Role::device;
  return devices && trigger.node == 0 ? "devices have PDOs, not the line: LINE:NODE" : "";
}

}  // namespace linegate::console
