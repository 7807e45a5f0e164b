// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/replay.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <utility>

#include "bridges/can/error_frame.h"
#include "bridges/can/log_file.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;

constexpr Duration kReopenPeriod = std::chrono::milliseconds(500);
constexpr std::size_t kReplayRoom = 64;
constexpr double kSlowestSpeed = 0.1;
constexpr double kFastestSpeed = 1000;

class ReplayChannel final : public Channel {
 public:
  ReplayChannel(std::string path, const ReplayOptions& options)
      : path_(std::move(path)), options_(options) {}

  int descriptor() const override { return -1; }

  std::size_t read(std::span<can::Frame> out, BusEvents& events, Instant now) override {
    if (!file_.is_open() && !ended_ && now >= wake_ && events.room() >= BusEvents::kPerFrame) {
      open(events, now);
    }
    std::size_t count = 0;
    while (file_.is_open() && count < out.size() && events.room() >= BusEvents::kPerFrame) {
      if (!waiting_ && !look_ahead(now)) {
        end(events, now);
        break;
      }
      if (due_ > now) {
        break;
      }
      const bool given = give(out[count], events);
      count += given ? 1U : 0U;
      events.frames_given(given ? 1U : 0U);
    }
    wake_ = file_.is_open() ? due_ : wake_;
    counters_.received += count;
    return count;
  }

  std::size_t write(std::span<const can::Frame> frames, Instant /*now*/) override {
    const std::size_t taken = file_.is_open() ? frames.size() : 0;
    counters_.sent += taken;
    counters_.confirmed += taken;
    counters_.acknowledged = counters_.taken();
    return taken;
  }

  std::size_t room(Instant /*now*/) const override { return file_.is_open() ? kReplayRoom : 0; }
  bool wants_writable() const override { return false; }
  Instant next_wake() const override { return wake_; }
  const ChannelCounters& counters() const override { return counters_; }

 private:
  void open(BusEvents& events, Instant now) {
    BusEvent event;
    event.time = now;
    if (const int error = file_.open(path_); error != 0) {
      wake_ = now + kReopenPeriod;
      event.kind = BusEvent::Kind::interface_failed;
      event.code = static_cast<std::uint32_t>(error);
      if (std::exchange(reported_, error) != error) {
        events.push(event);
        errors_.set_state(BusState::absent, now, events);
      }
      return;
    }
    event.kind = BusEvent::Kind::interface_ready;
    events.push(event);
    errors_.set_state(BusState::error_active, now, events);
    start_ = latest_ = now;
  }

  void end(BusEvents& events, Instant now) {
    file_.close();
    ended_ = true;
    wake_ = kNever;
    BusEvent event;
    event.kind = BusEvent::Kind::interface_failed;
    event.code = ENODATA;
    event.time = now;
    events.push(event);
    errors_.set_state(BusState::stopped, now, events);
  }

  // Finds the next entry and its due time. Returns false at the end of the log.
  bool look_ahead(Instant now) {
    LogProblem problem;
    for (;;) {
      const auto next = file_.next(entry_, problem);
      if (next == LogFile::Next::end) {
        return false;
      }
      if (next != LogFile::Next::entry) {
        ++counters_.malformed;
      } else if (options_.interface.empty() || entry_.interface == options_.interface) {
        break;
      }
    }
    waiting_ = true;
    due_ = std::max(latest_, due_time(now));
    return true;
  }

  Instant due_time(Instant now) {
    if (options_.speed == 0) {
      return now;
    }
    if (entry_.kind == LogEntry::Kind::frames_lost) {
      return latest_;  // the entry has no time of its own
    }
    if (!begun_) {
      begun_ = true;
      first_stamp_ = entry_.stamp_ns;
    }
    const double after = static_cast<double>(entry_.stamp_ns - first_stamp_) / options_.speed;
    return after < kLongest ? start_ + Duration(std::llround(after)) : kNever;
  }

  // Returns true if the entry is a frame.
  bool give(can::Frame& out, BusEvents& events) {
    waiting_ = false;
    latest_ = due_;
    switch (entry_.kind) {
      case LogEntry::Kind::frame:
        out = entry_.frame;
        out.time = due_;
        return true;
      case LogEntry::Kind::error_frame:
        errors_.decode(entry_.error, due_, events);
        return false;
      default:
        break;
    }
    BusEvent event;
    event.kind = BusEvent::Kind::frames_lost;
    event.count = entry_.lost;
    event.time = due_;
    events.push(event);
    counters_.lost += entry_.lost;
    return false;
  }

  static constexpr double kLongest = 1e18;  // ns: 31 years

  const std::string path_;
  const ReplayOptions options_;
  LogFile file_;
  ErrorDecoder errors_;
  ChannelCounters counters_;
  LogEntry entry_;  // the next entry; its interface was already checked
  bool waiting_ = false;
  bool begun_ = false;
  bool ended_ = false;
  int reported_ = 0;
  std::int64_t first_stamp_ = 0;
  Instant start_{};
  Instant latest_{};
  Instant due_{};
  Instant wake_{};
};

}  // namespace

ParsedReplay replay_options(const InterfaceUri& uri) {
  ParsedReplay parsed;
  for (const UriOption& option : uri.options) {
    if (option.key == "interface" && !option.value.empty()) {
      parsed.options.interface = option.value;
    } else if (option.key == "speed" && option.value == "max") {
      parsed.options.speed = 0;
    } else if (option.key == "speed") {
      const char* end = option.value.data() + option.value.size();
      const auto read = std::from_chars(option.value.data(), end, parsed.options.speed);
      if (read.ec != std::errc{} || read.ptr != end || !(parsed.options.speed >= kSlowestSpeed) ||
          !(parsed.options.speed <= kFastestSpeed)) {
        parsed.error =
            "speed of a replay is max or a number from 0.1 to 1000, not \"" + option.value + "\"";
      }
    } else {
      parsed.error = "a replay has the options speed and interface, not \"" + option.key + "=" +
                     option.value + "\"";
    }
  }
  return parsed;
}

std::unique_ptr<Channel> open_replay(std::string path, const ReplayOptions& options) {
  return std::make_unique<ReplayChannel>(std::move(path), options);
}

}  // namespace linegate::can_bridge
