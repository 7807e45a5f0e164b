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
  const bool has_room =
      waiting_.size() < kMostWaiting &&
      std::ranges::count(waiting_, sender, &Waiting::sender) < std::ptrdiff_t{kMostOfOne};
  if (has_room && (right == Right::publisher || may_become_publisher(right)))
    waiting_.push_back({std::move(event), sender, now});
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
