#include "stack/manager/shared_id.h"

#include <algorithm>

namespace linegate::manager {
namespace {

// A frame that a controller repeated is no second heartbeat.
constexpr Duration kRepeatedHeartbeat = std::chrono::milliseconds(5);
// Of the sum of two times: how much times of one device may vary, and how much those of two differ.
constexpr int kVaries = 16;
constexpr int kDiffers = 5;

}  // namespace

std::uint32_t SharedIds::heartbeat(std::uint8_t id, nmt::State state, Instant now) {
  Node& node = nodes_[id];
  const bool known = node.last != kNever;
  const Duration time = known ? now - node.last : Duration{};
  if (known && time < kRepeatedHeartbeat) {
    return 0;
  }
  if (known) {
    std::rotate(node.between.begin(), node.between.begin() + 1, node.between.end());
    node.between.back() = time;
    node.times = static_cast<std::uint8_t>(std::min<std::size_t>(node.times + 1U, kTimes));
    node.changes = node.state != state
                       ? static_cast<std::uint8_t>(std::min<unsigned>(node.changes + 1U, kChanges))
                       : std::uint8_t{0};
  }
  node.last = now;
  node.state = state;
  const bool two_states = node.changes == kChanges;
  if ((!two_states && !alternates(node)) ||
      (node.reported != kNever && now - node.reported < kQuiet)) {
    return 0;
  }
  node.reported = now;
  return two_states ? kTwoStates : kTwoRhythms;
}

void SharedIds::begin(std::uint8_t id) {
  for (std::size_t each = 0; each < nodes_.size(); ++each) {
    if (id == 0 || each == id) {
      nodes_[each] = {.reported = nodes_[each].reported};
    }
  }
}

// Long and short times in turn, both steady.
bool SharedIds::alternates(const Node& node) {
  if (node.times < kTimes) {
    return false;
  }
  std::array<Duration, 2> least{node.between[0], node.between[1]};
  std::array<Duration, 2> most = least;
  for (std::size_t i = 2; i < kTimes; ++i) {
    least[i % 2] = std::min(least[i % 2], node.between[i]);
    most[i % 2] = std::max(most[i % 2], node.between[i]);
  }
  const Duration sum = least[0] + least[1];
  const bool steady = most[0] - least[0] <= sum / kVaries && most[1] - least[1] <= sum / kVaries;
  const Duration gap = std::max(least[0], least[1]) - std::min(most[0], most[1]);
  return steady && gap >= sum / kDiffers;
}

}  // namespace linegate::manager
