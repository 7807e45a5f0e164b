// SPDX-License-Identifier: Apache-2.0
#include "gateway/process/status_text.h"

#include <fmt/format.h>

namespace linegate::gateway {
namespace {

bool bus_in_order(can::BusState bus) {
  return bus == can::BusState::error_active || bus == can::BusState::unknown;
}

// Describes the problem of a line; empty if there is none.
std::string complaint(const std::optional<line::LineState>& state) {
  if (!state) {
    return "starting";
  }
  if (!bus_in_order(state->bus)) {
    return std::string(can::name(state->bus));
  }
  // An observer has no own state.
  if (state->role != line::Role::observer && state->own_state == nmt::State::initialising) {
    return "waits for its interface";
  }
  if (state->nodes_operational < state->nodes_configured) {
    return fmt::format("{} of {} nodes operational", state->nodes_operational,
                       state->nodes_configured);
  }
  return {};
}

std::string lines_of(std::size_t count) {
  return fmt::format("{} line{}", count, count == 1 ? "" : "s");
}

}  // namespace

std::string status_text(std::span<const ShownLine> lines, std::span<const std::string> complaints) {
  std::size_t good = 0;
  std::string out;
  std::string first;
  for (const std::string& one : complaints) {
    first += one + "; ";
  }
  for (const auto& line : lines) {
    const std::string what = complaint(line.state);
    if (what.empty()) {
      ++good;
    } else {
      out += fmt::format("; {}: {}", line.name, what);
    }
  }
  if (good == lines.size()) {
    return first + lines_of(good) + " in order";
  }
  return fmt::format("{}{} of {} in order{}", first, good, lines_of(lines.size()), out);
}

}  // namespace linegate::gateway
