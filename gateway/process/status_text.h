// SPDX-License-Identifier: Apache-2.0
// The state of the gateway in one sentence, for `systemctl status`.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "stack/line/state.h"

namespace linegate::gateway {

struct ShownLine {
  std::string name;
  std::optional<line::LineState> state;  // nothing: not published yet
};

// "8 lines in order", or the number in order and the problem of each other line: "6 of 8 lines in
// order; hall: 3 of 4 nodes operational; pack: bus-off". complaints: what other parts of the
// gateway lack; they are first.
std::string status_text(std::span<const ShownLine> lines,
                        std::span<const std::string> complaints = {});

}  // namespace linegate::gateway
