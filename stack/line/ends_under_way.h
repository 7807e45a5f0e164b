// SPDX-License-Identifier: Apache-2.0
// NMT commands that end Operational, between the line and the bus: the values of their nodes become
// invalid with the acknowledgement of each, whatever commands follow. Private to stack/line.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "stack/nmt/node_control.h"

namespace linegate::line {

class EndsUnderWay {
 public:
  // The largest number of waiting commands; beyond it the oldest are dropped.
  static constexpr std::size_t kMost = 32;

  struct End {
    std::uint64_t number = 0;
    nmt::NodeControl control;
  };

  bool any() const { return count_ != 0; }
  // Call it when the frame with that number was handed to the bus. number: ascending.
  void handed_out(std::uint64_t number, const nmt::NodeControl& control) {
    if (count_ == kMost) {
      erase_first();
    }
    ends_[count_++] = {.number = number, .control = control};
  }
  // Removes and returns the oldest command if it is among the frames up to that number, which the
  // bus acknowledged.
  std::optional<End> take(std::uint64_t number) {
    if (count_ == 0 || ends_[0].number > number) {
      return std::nullopt;
    }
    const End out = ends_[0];
    erase_first();
    return out;
  }
  // The frames first..last will never be sent.
  void lost(std::uint64_t first, std::uint64_t last) {
    const auto end = ends_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto left = std::remove_if(ends_.begin(), end, [first, last](const End& each) {
      return each.number >= first && each.number <= last;
    });
    count_ = static_cast<std::size_t>(left - ends_.begin());
  }

 private:
  void erase_first() {
    std::move(ends_.begin() + 1, ends_.begin() + static_cast<std::ptrdiff_t>(count_),
              ends_.begin());
    --count_;
  }

  std::array<End, kMost> ends_{};  // ascending by number
  std::size_t count_ = 0;
};

}  // namespace linegate::line
