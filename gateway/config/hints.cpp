// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/hints.h"

#include <utility>

#include <fmt/format.h>

#include "stack/base/byte_order.h"
#include "stack/line/build.h"
#include "stack/line/pdo_checks.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::config {
namespace {

// The object that guarding or the heartbeat is written to, and the device file does not know; or 0.
std::uint16_t missing_error_control(const line::NodeConfig& node) {
  const bool guarded = node.guard_time > Duration::zero();
  const std::uint16_t index =
      guarded ? od::objects::kGuardTime : od::objects::kProducerHeartbeatTime;
  const bool written = guarded || node.heartbeat > Duration::zero();
  return written && node.device.find(od::Address{index, 0}) == nullptr ? index : std::uint16_t{0};
}

// A heartbeat that the device produces by default is not monitored unless the node has a consumer
// time.
bool has_error_control(const line::NodeConfig& node) {
  return node.guard_time > Duration::zero() || line::consumer_time(node) > Duration::zero();
}

std::uint64_t identity(const line::NodeConfig& node, std::uint8_t sub) {
  const od::VariableDescription* const known =
      node.device.find(od::Address{od::objects::kIdentity, sub});
  return known == nullptr ? 0 : load_le(std::span<const std::byte>(known->value));
}

// What is_manager says of the line: to the nodes of other lines nothing is written, and nobody
// boots or assigns them.
void add_node_hints(const std::string& line, bool is_manager, const line::NodeConfig& node,
                    std::vector<Diagnostic>& out) {
  const auto hint = [&](const std::string& text) {
    out.push_back(
        {Severity::warning, line, 0, 0, fmt::format("node {} ({}): {}", node.id, node.name, text)});
  };
  if (!has_error_control(node)) {
    hint("has neither heartbeat nor guarding: its loss is not detected");
  }
  if (!is_manager) {
    return;
  }
  if (const std::uint16_t missing = missing_error_control(node); missing != 0) {
    hint(fmt::format("its file has no object {}, which its error control is written to",
                     od::to_text({missing, 0})));
  }
  if (node.device.vendor_number == 0 && identity(node, 1) == 0) {
    const bool product = identity(node, 2) != 0;
    hint(product
             ? "its file has the vendor-ID 0: LSS and scan identify it by product code and "
               "revision number, the boot process does not compare the vendor-ID"
             : "its file has no vendor-ID and no product code: LSS and scan cannot identify it");
  }
}

}  // namespace

void add_hints(Loaded<Plant>& loaded) {
  if (!loaded.value) {
    return;
  }
  for (const LinePlan& line : loaded.value->lines) {
    if (auto waiting = line::unsynchronised_pdos(line.config)) {
      loaded.diagnostics.push_back(*std::move(waiting));
    }
    if (line.config.flying_master && line.config.heartbeat == Duration::zero()) {
      loaded.diagnostics.push_back(
          {Severity::warning, line.config.name, 0, 0,
           "flying_master without heartbeat of the line: the other masters miss this one only when "
           "it does not answer after a detect cycle"});
    }
    const bool is_manager = line.config.role == line::Role::manager;
    for (const line::NodeConfig& node : line.config.nodes) {
      add_node_hints(line.config.name, is_manager, node, loaded.diagnostics);
    }
  }
}

}  // namespace linegate::config
