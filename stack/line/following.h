// SPDX-License-Identifier: Apache-2.0
// Outputs of one line that follow inputs of the same or another line: reading the inputs and
// writing the outputs. The owner of the lines passes the values between the two.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/line.h"
#include "stack/line/output_write.h"
#include "stack/od/description.h"

namespace linegate::line {

// What happens to an output when the input that it follows is lost: no longer valid or, if it is
// forwarded, late.
enum class WhenLost : std::uint8_t {
  hold,  // the output keeps its value
  zero,  // the output becomes 0
  stop,  // the output becomes invalid, so that its PDO is not sent; forwarded outputs only
};
std::string_view name(WhenLost when_lost);

struct Following {
  struct Object {
    std::uint8_t node = 0;  // of the input entry; 0 = an object of LineConfig::forwarding
    od::Address address;
    // Entry::remote_pdo, because a device may map an object several times; 0 = not known
    std::uint16_t pdo = 0;
  };
  Object input;
  std::uint32_t output_entry = 0;  // of the outputs, among LineConfig::bound; or Line::kForwarded |
                                   // place in LineConfig::forwarding
  WhenLost when_lost = WhenLost::hold;
  // Every reception of the input's PDO requests the PDO of the output; otherwise only a new value
  // does.
  bool forwarded = false;
  // Of entries of more than 64 bits: 8 bytes of both, see image::value_parts().
  std::uint8_t part = 0;
  // Length of the input in bits, 0 = any: an input of another length is lost. Set by add_parts().
  std::uint32_t input_bits = 0;
};

// One for each part of entries with that number of bits; 0: of one part, with any number.
void add_parts(Following following, std::uint32_t bits, std::vector<Following>& to);

// Reads the inputs.
class FollowedInputs {
 public:
  explicit FollowedInputs(std::span<const Following> what);

  // Returns true if a value or its validity has changed, or a forwarded one was received again.
  // Never allocates.
  bool look(const Line& line);
  // In the order of `what`, as the last look() read them.
  const std::vector<Line::Input>& values() const { return values_; }

 private:
  void find_entries(const Line& line);

  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  std::vector<Following> what_;
  // Indices in the input layout, which changes for an observer
  std::vector<std::uint32_t> entries_;
  std::vector<Line::Input> values_;
  std::uint64_t revision_ = 0;
  bool first_ = true;
};

// Writes the outputs.
class FollowingOutputs {
 public:
  explicit FollowingOutputs(std::span<const Following> what);

  // Writes values that have changed or, if forwarded, were received again. Writes nothing before an
  // input was valid for the first time. Returns true if anything was written. Never allocates.
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
