// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <utility>

#include "bridges/can/log_file.h"
#include "bridges/can/replay.h"
#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

Scheme scheme_of(std::string_view name) {
  if (name == "socketcan") {
    return Scheme::socketcan;
  }
  if (name == "udp") {
    return Scheme::udp;
  }
  return name == "replay" ? Scheme::replay : Scheme::virtual_bus;
}

}  // namespace

Interface parse_interface(std::string_view text, const std::string& folder, std::string& error) {
  Interface out;
  out.uri = text;
  auto parsed = can_bridge::parse_uri(text);
  error = std::move(parsed.error);
  if (!error.empty()) {
    return out;
  }
  out.scheme = scheme_of(parsed.uri.scheme);
  out.name = std::move(parsed.uri.name);
  out.options = std::move(parsed.uri.options);
  if (out.scheme == Scheme::replay) {
    out.name = (std::filesystem::path(folder) / out.name).lexically_normal().string();
  }
  return out;
}

Interface read_interface(Section& line, const YAML::Node& node) {
  const auto text = line.text(node);
  if (!text || *text == "simulated:") {
    return text ? Interface{*text, Scheme::simulated, {}, {}} : Interface{};
  }
  const auto folder = std::filesystem::path(line.findings().file()).parent_path().string();
  std::string error;
  Interface out = parse_interface(*text, folder, error);
  if (!error.empty()) {
    line.findings().error(place_of(node), error + "; there is also simulated:");
    return out;
  }
  if (out.scheme == Scheme::replay) {
    const auto replay = can_bridge::replay_options({"replay", out.name, out.options});
    auto wrong = can_bridge::check_log(out.name, replay.options.interface);
    if (has_errors(wrong)) {
      line.findings().error(place_of(node), out.name + " cannot be replayed");
    }
    line.findings().add(std::move(wrong));
  }
  return out;
}

}  // namespace linegate::config
