// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_filter.h"

#include <algorithm>
#include <utility>

namespace linegate::dds {
namespace {

using RightToPublish = LinePublishers::Right;

RightToPublish right_to(const FollowedEvent& event, const ParticipantPrefix& sender,
                        const LinePublishers& publishers, Instant now) {
  return publishers.right_to_publish(event.source.gateway, event.source.line, sender, now);
}

bool may_become_publisher(RightToPublish right) {
  return right == RightToPublish::unknown || right == RightToPublish::contested;
}

}  // namespace

void EventFilter::take(FollowedEvent event, const ParticipantPrefix& sender,
                       const LinePublishers& publishers, Instant now, const PassOn& pass_on) {
  const RightToPublish right = right_to(event, sender, publishers, now);
  Waiting of{std::move(event), sender, now};
  const bool is_behind =
      std::ranges::any_of(waiting_, [&](const Waiting& each) { return each.is_of_line_of(of); });
  if (right == RightToPublish::publisher && !is_behind) {
    pass_on(of.event);
  } else if (right == RightToPublish::publisher || may_become_publisher(right)) {
    wait(std::move(of));
  }
}

bool EventFilter::Waiting::is_of_line_of(const Waiting& other) const {
  return sender == other.sender && event.source.line == other.event.source.line &&
         event.source.gateway == other.event.source.gateway;
}

// The oldest one gives way, so that those of a line which wait are its last ones: a gap between
// them would look like a loss.
void EventFilter::wait(Waiting event) {
  const auto is_of_line = [&](const Waiting& each) { return each.is_of_line_of(event); };
  const auto is_of_sender = [&](const Waiting& each) { return each.sender == event.sender; };
  const auto of_line = std::ranges::count_if(waiting_, is_of_line);
  const auto of_sender = std::ranges::count_if(waiting_, is_of_sender);
  const bool is_full = waiting_.size() >= kMostWaiting;
  if (is_full && of_sender == 0)
    return;
  if (of_line >= std::ptrdiff_t{kMostOfLine}) {
    waiting_.erase(std::ranges::find_if(waiting_, is_of_line));
  } else if (is_full || of_sender >= std::ptrdiff_t{kMostOfOne}) {
    waiting_.erase(std::ranges::find_if(waiting_, is_of_sender));
  }
  waiting_.push_back(std::move(event));
}

void EventFilter::advance(const LinePublishers& publishers, Instant now, const PassOn& pass_on) {
  for (Waiting& each : std::exchange(waiting_, {})) {
    const RightToPublish right = right_to(each.event, each.sender, publishers, now);
    if (right == RightToPublish::publisher) {
      pass_on(each.event);
    } else if (may_become_publisher(right) && now - each.received <= kPatience) {
      waiting_.push_back(std::move(each));
    }
  }
}

}  // namespace linegate::dds
