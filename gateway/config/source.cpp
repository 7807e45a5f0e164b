// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/source.h"

#include <functional>
#include <map>

namespace linegate::config {
namespace {

// The length prefix makes the encoding unambiguous.
std::string counted(std::string_view text) {
  return std::to_string(text.size()) + ':' + std::string(text);
}

std::string canonical_map(const YAML::Node& node) {
  std::map<std::string, std::string> members;
  for (const auto& member : node) {
    members[canonical(member.first)] = canonical(member.second);
  }
  std::string out = "{";
  for (const auto& [key, value] : members) {
    out += key + value;
  }
  return out + "}";
}

}  // namespace

std::string canonical(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return counted(node.Scalar());
    case YAML::NodeType::Map:
      return canonical_map(node);
    case YAML::NodeType::Sequence: {
      std::string out = "[";
      for (const auto& element : node) {
        out += canonical(element);
      }
      return out + "]";
    }
    case YAML::NodeType::Null:
    case YAML::NodeType::Undefined:
      break;
  }
  return "~";
}

std::string file_source(std::string_view path, std::string_view content) {
  return counted(path) + std::to_string(content.size()) + '#' +
         std::to_string(std::hash<std::string_view>{}(content)) + ';';
}

}  // namespace linegate::config
