// SPDX-License-Identifier: Apache-2.0
// Outputs of one line that follow inputs of the same or another: what is read there, and what is
// written here. Between the two ends the values are handed over by whoever runs the lines.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/line.h"
#include "stack/line/output_write.h"
#include "stack/od/description.h"

namespace linegate::line {

// What becomes of an output when the input it follows is lost: not valid any more or, if it is
// forwarded, late.
enum class WhenLost : std::uint8_t {
  hold,  // keeps its value
  zero,  // becomes 0
  stop,  // is not valid any more, so that its PDO is not sent; forwarded ones only
};
std::string_view name(WhenLost when_lost);

struct Following {
  struct Object {
    std::uint8_t node = 0;  // the entry of the inputs; 0 = an object of LineConfig::forwarding
    od::Address address;
  };
  Object input;
  std::uint32_t output_entry = 0;  // of the outputs, among LineConfig::bound; or Line::kForwarded |
                                   // place in LineConfig::forwarding
  WhenLost when_lost = WhenLost::hold;
  // Every PDO with the input is an event for the PDO with the output; else only a new value.
  bool forwarded = false;
};

// The end where the inputs are.
class FollowedInputs {
 public:
  explicit FollowedInputs(std::span<const Following> what);

  // True if anything has become another value, or (not) valid, or of what is forwarded: came once
  // more. Never allocates.
  bool look(const Line& line);
  // In the order of `what`, as look() found them.
  const std::vector<Line::Input>& values() const { return values_; }

 private:
  void find_entries(const Line& line);

  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  std::vector<Following> what_;
  std::vector<std::uint32_t> entries_;  // an observer's layout changes
  std::vector<Line::Input> values_;
  std::uint64_t revision_ = 0;
  bool first_ = true;
};

// The end where the outputs are.
class FollowingOutputs {
 public:
  explicit FollowingOutputs(std::span<const Following> what);

  // Writes what is another value than before or, forwarded, came once more. Nothing is written
  // before an input was valid for the first time. True if anything was written. Never allocates.
  bool take(Line& line, std::span<const Line::Input> values, Instant now);

 private:
  struct Written {
    std::uint64_t value = 0;
    Instant received{};
    bool any = false;
    bool valid = false;
  };
  void consider(const Following& following, const Line::Input& input, Written& written);

  std::vector<Following> what_;
  std::vector<Written> written_;
  std::vector<BoundValue> changed_;
};

}  // namespace linegate::line
