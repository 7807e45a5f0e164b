// SPDX-License-Identifier: Apache-2.0
// Moves frames between a channel and its user, in batches, without allocating.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>

#include "bridges/can/channel.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::gateway {

class FramePump {
 public:
  static constexpr std::size_t kBatch = 64;

  explicit FramePump(std::unique_ptr<can_bridge::Channel> channel)
      : channel_(std::move(channel)), counters_(channel_->counters()) {}

  can_bridge::Channel& channel() { return *channel_; }
  const can_bridge::Channel& channel() const { return *channel_; }

  // Reads until the channel is empty: calls receive(span of frames) and event(bus event) in their
  // order of occurrence, and between two reads between(time), to report_ended(): NMT commands are
  // acknowledged between the frames that precede and follow them on the bus. Returns the time up to
  // which everything was received: `now`, or the time of the last frame if that is later (it was
  // received while the channel was read) or if more frames are left.
  template <class Receive, class Event, class Between>
  Instant drain(Instant now, Receive&& receive, Event&& event, Between&& between) {
    Instant last = now;
    drained_ = 0;
    for (int i = 0; i < kBatchesAtOnce; ++i) {
      events_.clear();
      const std::size_t count = channel_->read(received_, events_, now);
      hand_over(std::span<const can::Frame>(received_.data(), count), receive, event);
      drained_ += count;
      if (count > 0) {
        last = received_[count - 1].time;
      }
      const bool empty =
          count < kBatch && !channel_->more() && events_.room() >= can_bridge::BusEvents::kPerFrame;
      if (empty || failed()) {
        return std::max(now, last);
      }
      between(std::max(now, last));
    }
    more_ = last;
    return last;
  }
  template <class Receive, class Event>
  Instant drain(Instant now, Receive&& receive, Event&& event) {
    return drain(now, receive, event, [](Instant) {});
  }
  // Number of frames of the last drain().
  std::size_t drained() const { return drained_; }
  // Whether the last drain() left frames in the channel.
  bool more() { return std::exchange(more_, kNever) != kNever; }

  // Pulls frames while the channel has room: next(frame) fills in the most urgent frame, or returns
  // false. It is not called again after that: writing gives it no new frame. Returns whether the
  // channel was given any frame.
  template <class Next>
  bool transmit(Instant now, Next&& next) {
    bool written = false;
    for (bool more = true; more;) {
      if (held_count_ == 0) {
        const std::size_t room = std::min(channel_->room(now), kBatch);
        while (held_count_ < room && next(held_[held_count_])) {
          ++held_count_;
        }
        more = held_count_ == room;
      }
      if (held_count_ == 0) {
        break;
      }
      written = true;
      const std::uint64_t before = counters_.taken();
      const std::uint64_t refused = counters_.refused;
      const std::size_t taken =
          channel_->write(std::span<const can::Frame>(held_.data(), held_count_), now);
      if (counters_.refused != refused) [[unlikely]] {
        first_refused_ = first_refused_ == 0 ? before + 1 : first_refused_;
        last_refused_ = before + taken;
      }
      if (taken < held_count_) [[unlikely]] {
        std::move(held_.begin() + static_cast<std::ptrdiff_t>(taken),
                  held_.begin() + static_cast<std::ptrdiff_t>(held_count_), held_.begin());
        held_count_ -= taken;
        break;
      }
      held_count_ = 0;
    }
    return written;
  }
  // Reports the outcome of the frames that transmit() pulled, numbered from 1 in that order:
  // lost(first, last) for frames that will never be sent, or may not have been, then
  // acknowledged(number) for all others up to that number.
  template <class Acknowledged, class Lost>
  void report_ended(Acknowledged&& acknowledged, Lost&& lost) {
    if (first_refused_ != 0) [[unlikely]] {
      lost(std::exchange(first_refused_, 0), last_refused_);
    }
    if (counters_.skipped != skipped_) [[unlikely]] {
      skipped_ = counters_.skipped;
      lost(acknowledged_ + 1, skipped_);
    }
    if (counters_.acknowledged != acknowledged_) {
      acknowledged_ = counters_.acknowledged;
      acknowledged(acknowledged_);
    }
    if (counters_.flushed != flushed_) [[unlikely]] {
      flushed_ = counters_.flushed;
      lost(acknowledged_ + 1, flushed_);
    }
  }
  // Number of frames that the channel refused; they are sent first next time.
  std::size_t held() const { return held_count_; }

 private:
  // Limits one drain(), so that other work gets its turn at any frame rate.
  static constexpr int kBatchesAtOnce = 16;

  // The next read() may reopen the interface with a descriptor of the same number: return first, so
  // that the owner of the epoll set sees that it was closed.
  bool failed() const {
    const std::span<const can::BusEvent> events = events_.view();
    return std::any_of(events.begin(), events.end(), [](const can::BusEvent& event) {
      return event.kind == can::BusEvent::Kind::interface_failed;
    });
  }

  // Keeps the order of frames and events: a frame received before a failure must not make values
  // valid again that the failure made invalid.
  template <class Receive, class Event>
  void hand_over(std::span<const can::Frame> frames, Receive& receive, Event& event) {
    std::size_t done = 0;
    const auto frames_until = [&](std::size_t end) {
      if (end > done) {
        receive(frames.subspan(done, end - done));
        done = end;
      }
    };
    for (std::size_t i = 0; i < events_.view().size(); ++i) {
      frames_until(events_.frames_before(i));
      event(events_.view()[i]);
    }
    frames_until(frames.size());
  }

  // First those that a round without events uses.
  std::unique_ptr<can_bridge::Channel> channel_;
  const can_bridge::ChannelCounters& counters_;  // of the channel
  std::size_t held_count_ = 0;
  std::size_t drained_ = 0;
  Instant more_ = kNever;
  // Numbers of frames, see report_ended().
  std::uint64_t acknowledged_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t flushed_ = 0;
  std::uint64_t first_refused_ = 0;
  std::uint64_t last_refused_ = 0;
  can_bridge::BusEvents events_;
  std::array<can::Frame, kBatch> received_{};
  std::array<can::Frame, kBatch> held_{};
};

}  // namespace linegate::gateway
