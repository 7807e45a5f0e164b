// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/recorder.h"

#include <array>
#include <system_error>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include "bridges/can/candump.h"
#include "bridges/can/sendable.h"
#include "gateway/runtime/clock.h"

namespace linegate::gateway {
namespace {

// Time between two checks of the rings; a ring that fills faster wakes the writer.
constexpr int kPeriodMs = 100;
constexpr Duration kRetryPeriod = std::chrono::seconds(1);

}  // namespace

Recording::Recording(std::string line, std::string interface, const config::Record& plan,
                     exchange::Wakeup& writer, FileCalls& calls)
    : line_(std::move(line)),
      interface_(std::move(interface)),
      file_name_(plan.file.empty() ? "the standard output" : plan.file),
      writer_(writer),
      file_(plan, calls) {
  text_.reserve(kBatch + can_bridge::kLogLine);
}

// --- executor -----------------------------------------------------------------------------------

void Recording::add(const can::Frame& frame) {
  next_.is_event = false;
  next_.frame = frame;
  push();
}

void Recording::add(const can::BusEvent& event) {
  next_.is_event = true;
  next_.event = event;
  push();
}

void Recording::push() {
  constexpr std::size_t kLook = kPlaces / 8;
  if (!entries_.push(next_)) {
    overflows_.add();
  }
  if (++since_look_ >= kLook) {
    since_look_ = 0;
    if (entries_.room() < kPlaces / 2) {
      writer_.signal();
    }
  }
}

std::size_t RecordingChannel::read(std::span<can::Frame> out, can_bridge::BusEvents& events,
                                   Instant now) {
  const std::size_t count = channel_->read(out, events, now);
  std::size_t done = 0;
  for (std::size_t i = 0; i < events.view().size(); ++i) {
    for (; done < events.frames_before(i); ++done) {
      recording_.add(out[done]);
    }
    recording_.add(events.view()[i]);
  }
  for (; done < count; ++done) {
    recording_.add(out[done]);
  }
  return count;
}

std::size_t RecordingChannel::write(std::span<const can::Frame> frames, Instant now) {
  const std::size_t taken = channel_->write(frames, now);
  const bool fd = channel_->carries_fd();
  for (const can::Frame& frame : frames.first(taken)) {
    if (!can_bridge::sendable(frame, fd)) {
      continue;  // accepted by the channel and dropped
    }
    sent_ = frame;
    sent_.time = now;
    recording_.add(sent_);
  }
  return taken;
}

// --- writer -------------------------------------------------------------------------------------

void Recording::work(Instant now, Duration utc) {
  // The entries that overflowed are newer than those in the ring.
  const std::uint64_t overflows = overflows_.value();
  while (entries_.pop(taken_)) {
    take(taken_, utc);
    if (text_.size() >= kBatch) {
      flush(now);
    }
  }
  if (overflows != overflows_seen_) {
    miss(overflows - overflows_seen_);
    overflows_seen_ = overflows;
    spdlog::warn("{}: {} frames are not recorded, the disk is too slow", line_, missing_);
  }
  flush(now);
}

void Recording::take(const Entry& entry, Duration utc) {
  std::array<char, can_bridge::kLogLine> out;
  const auto stamp = [&](Instant time) { return (time.time_since_epoch() + utc).count(); };
  std::size_t length = 0;
  if (!entry.is_event) {
    length = can_bridge::format_log_line(out, stamp(entry.frame.time), interface_, entry.frame);
    ++frames_in_text_;
  } else if (entry.event.kind == can::BusEvent::Kind::frames_lost) {
    all_missing_ += entry.event.count;
    length = can_bridge::format_lost(out, interface_, entry.event.count, all_missing_);
  } else if (worth_a_line(entry.event)) {
    length = can_bridge::format_log_line(out, stamp(entry.event.time), interface_, entry.event);
  }
  text_.append(out.data(), length);
}

// Error-active is recorded only if the controller was in another state before.
bool Recording::worth_a_line(const can::BusEvent& event) {
  if (event.kind != can::BusEvent::Kind::state) {
    return true;
  }
  const bool was_active = std::exchange(active_, event.state == can::BusState::error_active);
  return !(was_active && active_);
}

void Recording::flush(Instant now) {
  if (error_ != 0 && now < again_) {
    miss(std::exchange(frames_in_text_, 0));
    text_.clear();
    return;
  }
  if (missing_ > 0) {
    std::array<char, can_bridge::kLogLine> out;
    const std::size_t length =
        can_bridge::format_lost(out, interface_, missing_, all_missing_ + missing_);
    // Before the frames recorded since the disk failed, or after those recorded before the loss.
    text_.insert(error_ != 0 ? 0 : text_.size(), out.data(), length);
  }
  if (text_.empty()) {
    return;
  }
  if (const int error = file_.append(text_); error != 0) {
    failed(error, now);
  } else {
    works_again();
  }
  frames_in_text_ = 0;
  text_.clear();
}

void Recording::miss(std::uint64_t frames) {
  missing_ += frames;
  unwritten_ += frames;
}

void Recording::failed(int error, Instant now) {
  miss(frames_in_text_);
  again_ = now + kRetryPeriod;
  if (std::exchange(error_, error) == 0) {
    spdlog::error("{}: recording to {} stopped: {}; it continues when the cause is removed", line_,
                  file_name_, std::generic_category().message(error));
  }
}

void Recording::works_again() {
  if (std::exchange(error_, 0) != 0) {
    spdlog::info("{}: recording to {} goes on, {} frames are missing", line_, file_name_, missing_);
  }
  all_missing_ += std::exchange(missing_, 0);
}

Recording& Recorder::add(std::string line, std::string interface, const config::Record& plan,
                         FileCalls& calls) {
  recordings_.push_back(
      std::make_unique<Recording>(std::move(line), std::move(interface), plan, wakeup_, calls));
  return *recordings_.back();
}

void Recorder::remove(const Recording& recording) {
  std::erase_if(recordings_, [&](const auto& other) { return other.get() == &recording; });
}

void Recorder::start() {
  stop_.lower();
  if (!recordings_.empty()) {
    thread_ = std::thread([this] { run(); });
  }
}

void Recorder::stop() {
  stop_.raise();
  wakeup_.signal();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Recorder::run() {
  pthread_setname_np(pthread_self(), "recorder");
  WallClock clock;
  for (;;) {
    wakeup_.clear();
    const bool last = stop_.raised();
    clock.refresh();
    for (const auto& recording : recordings_) {
      recording->work(monotonic_now(), clock.map().offset);
    }
    if (last) {
      return;
    }
    pollfd waiting{wakeup_.descriptor(), POLLIN, 0};
    poll(&waiting, 1, kPeriodMs);
  }
}

}  // namespace linegate::gateway
