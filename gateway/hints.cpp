#include "gateway/hints.h"

#include <utility>

#include <fmt/format.h>

#include "stack/line/pdo_checks.h"

namespace linegate::gateway {
namespace {

// The object that guarding or the heartbeat is written to, and the device file does not know; or 0.
std::uint16_t missing_error_control(const line::NodeConfig& node) {
  constexpr std::uint16_t kGuardTime = 0x100C;
  constexpr std::uint16_t kHeartbeat = 0x1017;
  const bool guarded = node.guard_time > Duration::zero();
  const std::uint16_t index = guarded ? kGuardTime : kHeartbeat;
  const bool written = guarded || node.heartbeat > Duration::zero();
  return written && node.device.find(od::Address{index, 0}) == nullptr ? index : std::uint16_t{0};
}

}  // namespace

void add_hints(Loaded<config::Plant>& loaded) {
  if (!loaded.value) {
    return;
  }
  for (const config::LinePlan& line : loaded.value->lines) {
    if (auto waiting = line::unsynchronised_pdos(line.config)) {
      loaded.diagnostics.push_back(*std::move(waiting));
    }
    if (line.config.role != line::Role::manager) {
      continue;  // nothing is written to its nodes
    }
    for (const line::NodeConfig& node : line.config.nodes) {
      if (const std::uint16_t missing = missing_error_control(node); missing != 0) {
        loaded.diagnostics.push_back({Severity::warning, line.config.name, 0, 0,
                                      fmt::format("node {} ({}): its file has no object {:04X}:00, "
                                                  "which its error control is written to",
                                                  node.id, node.name, missing)});
      }
    }
  }
}

}  // namespace linegate::gateway
