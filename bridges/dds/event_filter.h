// SPDX-License-Identifier: Apache-2.0
// The events that a gateway takes from other gateways: those of the participant that publishes the
// LineState of their line, by the rule for replies (LinePublishers). Whatever another participant
// publishes in the name of the line is discarded.
//
// An event may be received before the first state of its line, or while an ended publisher is not
// known to be silent: it waits for kPatience. No DDS: samples go in, events come out.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>

#include "bridges/dds/event_follower.h"
#include "bridges/dds/line_publishers.h"
#include "stack/base/time.h"

namespace linegate::dds {

class EventFilter {
 public:
  static constexpr Duration kPatience = LinePublishers::kSilence;
  // That wait: all, of one participant, and of one of its lines.
  static constexpr std::size_t kMostWaiting = 4'096;
  static constexpr std::size_t kMostOfOne = 1'024;
  static constexpr std::size_t kMostOfLine = 256;

  using PassOn = std::function<void(const FollowedEvent& event)>;

  // The events of a line are passed on in their order.
  void take(FollowedEvent event, const ParticipantPrefix& sender, const LinePublishers& publishers,
            Instant now, const PassOn& pass_on);
  // Call it after states were received, before take().
  void advance(const LinePublishers& publishers, Instant now, const PassOn& pass_on);

 private:
  struct Waiting {
    FollowedEvent event;
    ParticipantPrefix sender{};
    Instant received{};
    bool is_of_line_of(const Waiting& other) const;
  };

  void wait(Waiting event);

  std::deque<Waiting> waiting_;
};

}  // namespace linegate::dds
