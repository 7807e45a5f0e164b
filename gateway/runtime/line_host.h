// SPDX-License-Identifier: Apache-2.0
// A line as the threads of the gateway share it: constant data, and the port.
#pragma once

#include <optional>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_port.h"
#include "gateway/runtime/recorder.h"
#include "gateway/runtime/runner.h"
#include "gateway/runtime/storage_thread.h"
#include "stack/image/layout.h"

namespace linegate::gateway {

class LineRunner;

struct LineHost {
  LineHost(config::LinePlan line_plan, image::Layout input_layout, image::Layout output_layout)
      : plan(std::move(line_plan)),
        layouts{std::move(input_layout), std::move(output_layout)},
        port(room_for_receptions(plan.config)) {}

  // The main thread changes the routes while publisher, request receiver and the thread of routes
  // over other gateways are stopped.
  config::LinePlan plan;
  const std::array<image::Layout, 2> layouts;  // by image::Direction
  LinePort port;
  exchange::Handover<line::LineState> shown;  // publisher to main thread: as published
  Executor* executor = nullptr;               // set before the line runs
  // For the gateway, which stops the line: its runner, the runner of its simulated devices, its
  // files.
  LineRunner* runner = nullptr;
  Runner* devices = nullptr;
  std::vector<NodeStorage> storage;
  Recording* recording = nullptr;
  std::optional<line::LineState> last_shown;  // from `shown`, for the thread that fetches it

  // The interface number in routing; 0 if the line does not route.
  std::uint8_t interface() const { return plan.config.routing.interface; }
  const std::string& name() const { return plan.config.name; }
  const image::Layout& layout(image::Direction direction) const {
    return layouts[static_cast<std::size_t>(direction)];
  }
};

}  // namespace linegate::gateway
