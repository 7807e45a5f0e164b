// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/entry_names.h"

#include <algorithm>

#include "gateway/config/value.h"
#include "stack/line/srdo_plan.h"

namespace linegate::config {

std::vector<std::uint32_t> EntryNames::find(const std::string& text, bool several) const {
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < layout_.entries.size(); ++i) {
    if (layout_.entries[i].name == text) {
      return {i};
    }
  }
  const std::size_t dot = text.find('.');
  const auto node = node_id(text.substr(0, dot));
  if (!node || dot == std::string::npos) {
    return out;
  }
  const std::string object = text.substr(dot + 1);
  const auto address = parse_address(object);
  for (std::uint32_t i = 0; i < layout_.entries.size(); ++i) {
    const auto& entry = layout_.entries[i];
    const bool matches =
        object == "*" ? several
                      : address && entry.index == address->index && entry.sub == address->sub;
    if (entry.node == *node && matches) {
      out.push_back(i);
    }
  }
  const auto is_srdo = [this](std::uint32_t entry) {
    return image::is_srdo(layout_.entries[entry].remote_pdo);
  };
  if (object != "*" && !std::ranges::all_of(out, is_srdo)) {
    std::erase_if(out, is_srdo);
  }
  return out;
}

std::string EntryNames::ambiguity(const std::string& text) const {
  const std::vector<std::uint32_t> found = find(text, false);
  if (found.size() < 2) {
    return "";
  }
  std::string names;
  for (const std::uint32_t entry : found) {
    names += (names.empty() ? "\"" : ", \"") + layout_.entries[entry].name + "\"";
  }
  return "\"" + text + "\" is ambiguous: " + names;
}

// Empty, or why an object that an SRDO carries is no output.
std::string EntryNames::srdo_reason(const std::string& text) const {
  const std::size_t dot = text.find('.');
  const auto id = node_id(text.substr(0, dot));
  if (layout_.direction != image::Direction::outputs || !id || dot == std::string::npos) {
    return "";
  }
  const auto node = std::ranges::find(config_.nodes, *id, &line::NodeConfig::id);
  if (node == config_.nodes.end()) {
    return "";
  }
  for (const od::ObjectDescription& object : node->device.objects) {
    for (const od::VariableDescription& variable : object.variables) {
      const od::Address address{object.index, variable.sub};
      const std::string wanted = text.substr(dot + 1);
      if (wanted != variable.name && wanted != variable.alias && parse_address(wanted) != address) {
        continue;
      }
      if (const std::uint8_t number = line::received_srdo(*node, address); number != 0) {
        return ": the node receives it by SRDO " + std::to_string(number) +
               ", and Linegate produces no SRDOs";
      }
    }
  }
  return "";
}

std::string EntryNames::suggestion(const std::string& text) const {
  if (std::string reason = srdo_reason(text); !reason.empty()) {
    return reason;
  }
  std::vector<std::string> names;
  for (const auto& entry : layout_.entries) {
    names.push_back(entry.name);
  }
  const std::string guess = nearest(text, names);
  return guess.empty() ? "" : "; did you mean \"" + guess + "\"?";
}

std::optional<std::uint8_t> EntryNames::node_id(const std::string& name) const {
  for (const auto& node : config_.nodes) {
    if (node.name == name) {
      return node.id;
    }
  }
  for (const auto& device : config_.devices) {
    if (device.name == name) {
      return device.id;
    }
  }
  return std::nullopt;
}

}  // namespace linegate::config
