// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_filter.h"

#include <algorithm>
#include <utility>

namespace linegate::dds {
namespace {

using Right = LinePublishers::Right;

Right right_to(const FollowedEvent& event, const ParticipantPrefix& sender,
               const LinePublishers& publishers, Instant now) {
  return publishers.right_to_publish(event.source.gateway, event.source.line, sender, now);
}

bool may_become_publisher(Right right) {
  return right == Right::unknown || right == Right::contested;
}

}  // namespace

void EventFilter::take(FollowedEvent event, const ParticipantPrefix& sender,
                       const LinePublishers& publishers, Instant now, const PassOn& pass_on) {
  const Right right = right_to(event, sender, publishers, now);
  const auto is_of_line = [&](const Waiting& each) {
    return each.sender == sender && each.event.source.line == event.source.line &&
           each.event.source.gateway == event.source.gateway;
  };
  const bool is_behind = std::ranges::any_of(waiting_, is_of_line);
  if (right == Right::publisher && !is_behind) {
    pass_on(event);
    return;
  }
  if (right == Right::publisher || may_become_publisher(right))
    wait({std::move(event), sender, now});
}

// The oldest one of the participant gives way: a gap between those that wait would look like a
// loss.
void EventFilter::wait(Waiting event) {
  const auto of_sender = std::ranges::count(waiting_, event.sender, &Waiting::sender);
  const bool is_full = waiting_.size() >= kMostWaiting;
  if (is_full && of_sender == 0)
    return;
  if (is_full || of_sender >= std::ptrdiff_t{kMostOfOne})
    waiting_.erase(std::ranges::find(waiting_, event.sender, &Waiting::sender));
  waiting_.push_back(std::move(event));
}

void EventFilter::advance(const LinePublishers& publishers, Instant now, const PassOn& pass_on) {
  for (Waiting& each : std::exchange(waiting_, {})) {
    const Right right = right_to(each.event, each.sender, publishers, now);
    if (right == Right::publisher) {
      pass_on(each.event);
    } else if (may_become_publisher(right) && now - each.received <= kPatience) {
      waiting_.push_back(std::move(each));
    }
  }
}

}  // namespace linegate::dds
