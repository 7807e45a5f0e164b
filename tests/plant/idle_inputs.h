// SPDX-License-Identifier: Apache-2.0
// Oracle: an advance() that returns false has changed no input, nor has an acknowledgement. The
// owner of a line therefore need not read the inputs again, see gateway/runtime/line_runner.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "stack/line/line.h"

namespace linegate::plant {

class IdleInputs {
 public:
  // Call it after frames were received, and after an advance() that returned true.
  void note(const line::Line& line) {
    line_ = &line;
    inputs_.clear();
    for (std::uint32_t i = 0; i < count(line); ++i) {
      inputs_.push_back(line.input(i));
    }
  }

  // Call it after an advance() that returned false. Returns the error; empty if there is none.
  std::string compare(const line::Line& line) const {
    if (line_ != &line || inputs_.size() != count(line)) {
      return "a new line was idle";
    }
    for (std::uint32_t i = 0; i < count(line); ++i) {
      const line::Line::Input now = line.input(i);
      const line::Line::Input& then = inputs_[i];
      if (now.value != then.value || now.valid != then.valid || now.late != then.late ||
          now.received != then.received) {
        return "input " + std::to_string(i) + " has changed, but the line was idle";
      }
    }
    return {};
  }

 private:
  static std::size_t count(const line::Line& line) {
    return line.layout(image::Direction::inputs).entries.size();
  }

  const line::Line* line_ = nullptr;
  std::vector<line::Line::Input> inputs_;
};

}  // namespace linegate::plant
