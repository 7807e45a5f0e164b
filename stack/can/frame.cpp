// SPDX-License-Identifier: Apache-2.0
#include "stack/can/frame.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate::can {
namespace {

// The arbitration field as one number; the lower number wins. The RTR bit follows the identifier of
// a standard frame, the recessive SRR and IDE bits follow the first eleven bits of an extended one,
// so the standard frame wins if these eleven bits are equal.
std::uint64_t arbitration_field(const Frame& frame) {
  const std::uint64_t remote = frame.remote() ? 1 : 0;
  if (!frame.extended()) {
    return (std::uint64_t{frame.id} << 21U) | (remote << 20U);
  }
  const std::uint64_t base = frame.id >> 18U;
  const std::uint64_t rest = frame.id & 0x3FFFFU;
  return (base << 21U) | (0x3ULL << 19U) | (rest << 1U) | remote;
}

}  // namespace

Frame make_frame(std::uint32_t id, std::span<const std::byte> data) {
  Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(std::min(data.size(), kMaxClassicData));
  std::copy_n(data.begin(), frame.length, frame.data.begin());
  return frame;
}

Frame make_frame(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
  return make_frame(id, std::as_bytes(std::span(data.begin(), data.size())));
}

bool same_content(const Frame& a, const Frame& b) {
  return a.id == b.id && a.flags == b.flags && std::ranges::equal(a.bytes(), b.bytes());
}

std::uint8_t fd_length(std::size_t length) {
  constexpr std::array<std::uint8_t, 8> kSteps{8, 12, 16, 20, 24, 32, 48, 64};
  LINEGATE_ASSERT_HOT(length <= kMaxFdData, "the data fits into an FD frame");
  if (length <= 8) {
    return static_cast<std::uint8_t>(length);
  }
  return *std::ranges::lower_bound(kSteps, static_cast<std::uint8_t>(length));
}

bool wins_arbitration(const Frame& a, const Frame& b) {
  return arbitration_field(a) < arbitration_field(b);
}

}  // namespace linegate::can
