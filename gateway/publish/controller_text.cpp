// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/controller_text.h"

#include <fmt/format.h>

namespace linegate::gateway {

std::vector<std::string> complaints(const config::LinePlan& plan,
                                    const can_bridge::ControllerSetup& controller) {
  std::vector<std::string> out;
  const std::uint32_t wanted = plan.config.bit_rate;
  if (wanted != 0 && controller.bit_rate != 0 && controller.bit_rate != wanted) {
    out.push_back(fmt::format("{} runs at {} bit/s, but the configuration of the line has {} bit/s",
                              plan.interface.uri, controller.bit_rate, wanted));
  }
  if (!controller.listen_only) {
    return out;
  }
  const bool observes = plan.config.role == line::Role::observer;
  if (observes && !*controller.listen_only) {
    out.push_back(
        fmt::format("{} acknowledges frames of other nodes, although the line only observes: ip "
                    "link set {} type can "
                    "listen-only on, while it is down",
                    plan.interface.uri, plan.interface.name));
  }
  if (!observes && *controller.listen_only) {
    out.push_back(fmt::format(
        "{} listens only: nothing that the line sends gets to the bus: ip link set {} type can "
        "listen-only off, while it is down",
        plan.interface.uri, plan.interface.name));
  }
  return out;
}

void add_properties(const can_bridge::ControllerSetup& controller, std::vector<Property>& out) {
  if (controller.listen_only) {
    out.push_back({"listen-only", *controller.listen_only ? "on" : "off"});
  }
  if (controller.restart_ms) {
    out.push_back({"restart-ms", std::to_string(*controller.restart_ms)});
  }
  if (controller.hardware_stamps) {
    out.push_back({"time-stamps", "hardware"});
  }
}

}  // namespace linegate::gateway
