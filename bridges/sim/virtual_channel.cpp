// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/virtual_channel.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <mutex>
#include <random>
#include <utility>
#include <vector>

#include <sys/timerfd.h>
#include <unistd.h>

#include "bridges/can/sendable.h"
#include "stack/can/cob_id.h"

namespace linegate::sim {
namespace {

using can::BusEvent;
using can::BusState;

constexpr Duration kRetryPeriod = std::chrono::milliseconds(500);

// A descriptor that becomes readable at an instant of the monotonic clock.
class Timer {
 public:
  Timer() = default;
  ~Timer() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  // Returns 0 or errno.
  int open() {
    descriptor_ = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    return descriptor_ >= 0 ? 0 : errno;
  }

  // Also clears the readable state of an expired timer.
  void arm(Instant at) {
    if (descriptor_ < 0) {
      return;
    }
    armed_ = at;
    itimerspec when{};
    if (at != kNever) {
      const auto ns = std::max<Duration::rep>(at.time_since_epoch().count(), 1);
      when.it_value.tv_sec = ns / 1'000'000'000;
      when.it_value.tv_nsec = ns % 1'000'000'000;
    }
    ::timerfd_settime(descriptor_, TFD_TIMER_ABSTIME, &when, nullptr);
  }

  int descriptor() const { return descriptor_; }
  Instant armed() const { return armed_; }

 private:
  int descriptor_ = -1;
  Instant armed_ = kNever;
};

// Whether the frame's identifier belongs to that node in the predefined connection set (CiA
// 301 7.3.3); node 0: never.
bool is_from(const can::Frame& frame, std::uint8_t node) {
  constexpr std::array<std::uint32_t, 7> kServices{
      can::kEmcyBase, 0x180, 0x280, 0x380, 0x480, can::kSdoResponseBase, can::kErrorControlBase};
  return node != 0 && std::any_of(kServices.begin(), kServices.end(),
                                  [&](std::uint32_t base) { return frame.id == base + node; });
}

struct Member {
  Bus::Endpoint endpoint = 0;
  Timer timer;
};

// A bus and its open endpoints. All members require the mutex. Invariant: each member's timer
// expires no later than the next change on the bus.
struct SharedBus {
  explicit SharedBus(const BusOptions& options) : bus(options) {}

  void wake_members() {
    const Instant wake = bus.next_wake();
    for (Member* member : members) {
      if (wake < member->timer.armed()) {
        member->timer.arm(wake);
      }
    }
  }

  void advance(Instant now) {
    time = now;
    bus.advance(now);
  }

  // Selects the outcome of each frame at random and by time.
  void set_faults(const can_bridge::VirtualFaults& wanted) {
    faults = wanted;
    bus.set_disturbance(
        [this, random = std::mt19937(faults.seed)](const can::Frame& frame, Bus::Endpoint) mutable {
          if (is_from(frame, faults.stuck) && is_stuck()) {
            return Fate::lost;
          }
          double dice = std::uniform_real_distribution<>(0, 1)(random);
          if ((dice -= faults.lost) < 0) {
            return Fate::lost;
          }
          if ((dice -= faults.disturbed) < 0) {
            ++disturbed;
            return Fate::disturbed;
          }
          return dice < faults.doubled ? Fate::doubled : Fate::delivered;
        });
  }

  // The node alternates every stuck_time since the first endpoint opened, working first.
  bool is_stuck() const {
    return faults.stuck_time <= Duration{} || (time - opened) / faults.stuck_time % 2 == 1;
  }

  std::mutex mutex;
  Bus bus;
  can_bridge::VirtualFaults faults;  // faults of the whole bus
  Instant time{};                    // of the last call
  Instant opened = kNever;           // when the first endpoint opened
  std::vector<Member*> members;
  std::uint64_t disturbed = 0;  // number of disturbed frames
};

class VirtualChannel final : public can_bridge::Channel {
 public:
  VirtualChannel(std::shared_ptr<SharedBus> shared, const can_bridge::VirtualFaults& faults)
      : shared_(std::move(shared)), faults_(faults) {
    const std::scoped_lock lock(shared_->mutex);
    if (faults.of_bus()) {
      shared_->set_faults(faults);
    }
    self_.endpoint = shared_->bus.attach();
    shared_->bus.set_connected(self_.endpoint, false, Instant{});  // until the channel is ready
  }

  ~VirtualChannel() override {
    const std::scoped_lock lock(shared_->mutex);
    std::erase(shared_->members, &self_);
    shared_->bus.detach(self_.endpoint);
  }

  VirtualChannel(const VirtualChannel&) = delete;
  VirtualChannel& operator=(const VirtualChannel&) = delete;

  int descriptor() const override { return self_.timer.descriptor(); }

  std::size_t read(std::span<can::Frame> out, can_bridge::BusEvents& events, Instant now) override {
    if (events.room() < can_bridge::BusEvents::kPerFrame) {
      return 0;
    }
    const std::scoped_lock lock(shared_->mutex);
    Bus& bus = shared_->bus;
    shared_->advance(now);
    if (descriptor() < 0 && !open(events, now)) {
      return 0;
    }
    change_state(events, now);
    const std::size_t count = bus.take(self_.endpoint, out, now);
    counters_.received += count;
    counters_.confirmed = bus.sent(self_.endpoint);
    // Refused frames have no number on the bus.
    const std::uint64_t left = bus.acknowledged(self_.endpoint);
    counters_.acknowledged =
        std::max(counters_.acknowledged, left == counters_.sent ? counters_.taken() : left);
    report_lost(bus.pop_lost(self_.endpoint), events, count > 0 ? out[0].time : now);
    events.frames_given(count);
    report_disturbed(events, now);
    const Instant wake =
        earlier(earlier(bus.first_waiting(self_.endpoint), bus.next_wake()), change_at_);
    if (wake != self_.timer.armed() || wake <= now) {
      self_.timer.arm(wake);
    }
    return count;
  }

  std::size_t write(std::span<const can::Frame> frames, Instant now) override {
    if (descriptor() < 0 || is_bus_off_) {
      return 0;
    }
    const std::scoped_lock lock(shared_->mutex);
    shared_->advance(now);
    std::size_t taken = 0;
    while (taken < frames.size() && submit(frames[taken], now)) {
      ++taken;
    }
    counters_.stalled += taken < frames.size() ? 1U : 0U;
    shared_->wake_members();
    return taken;
  }

  std::size_t room(Instant /*now*/) const override {
    if (descriptor() < 0 || is_bus_off_) {
      return 0;
    }
    const std::scoped_lock lock(shared_->mutex);
    return shared_->bus.room(self_.endpoint);
  }

  bool wants_writable() const override { return false; }
  Instant next_wake() const override { return descriptor() < 0 ? retry_at_ : kNever; }
  const can_bridge::ChannelCounters& counters() const override { return counters_; }
  int restart(Instant now) override {
    if (!is_bus_off_) {
      return EBUSY;
    }
    set_change(now);
    return 0;
  }
  int fault(std::string_view change, std::string& said, Instant now) override {
    const std::scoped_lock lock(shared_->mutex);
    shared_->advance(now);
    const can_bridge::FaultChange wanted = can_bridge::change_faults(faults(), change);
    if (!wanted.error.empty()) {
      said = wanted.error;
      return EINVAL;
    }
    said = can_bridge::to_string(wanted.faults);
    if (!change.empty()) {
      apply(wanted, now);
    }
    return 0;
  }

 private:
  bool open(can_bridge::BusEvents& events, Instant now) {
    if (now < retry_at_) {
      return false;
    }
    BusEvent event;
    event.time = now;
    if (const int error = self_.timer.open(); error != 0) {
      retry_at_ = now + kRetryPeriod;
      event.kind = BusEvent::Kind::interface_failed;
      event.code = static_cast<std::uint32_t>(error);
      if (!std::exchange(failed_, true)) {
        events.push(event);
      }
      return false;
    }
    shared_->members.push_back(&self_);
    shared_->opened = earlier(shared_->opened, now);
    shared_->bus.set_connected(self_.endpoint, true, now);
    event.kind = BusEvent::Kind::interface_ready;
    events.push(event);
    event.kind = BusEvent::Kind::state;
    event.state = BusState::error_active;
    events.push(event);
    disturbed_ = shared_->disturbed;
    change_at_ = after(now, faults_.bus_off);
    return true;
  }

  static Instant after(Instant now, Duration time) {
    return time > Duration{} ? now + time : kNever;
  }
  Instant next_change(Instant now) const {
    return is_bus_off_ ? after(now, faults_.restart)
                       : after(now, std::max(faults_.bus_off - faults_.restart, Duration{}));
  }
  void set_change(Instant at) {
    change_at_ = at;
    self_.timer.arm(earlier(self_.timer.armed(), at));
  }

  // The faults of the bus, and those of this endpoint.
  can_bridge::VirtualFaults faults() const {
    can_bridge::VirtualFaults all = shared_->faults;
    all.bus_off = faults_.bus_off;
    all.restart = faults_.restart;
    return all;
  }
  void apply(const can_bridge::FaultChange& wanted, Instant now) {
    const bool other_times =
        wanted.faults.bus_off != faults_.bus_off || wanted.faults.restart != faults_.restart;
    faults_ = wanted.faults;
    shared_->set_faults(wanted.faults);
    if (wanted.bus_off_now || wanted.bus_off_ends) {
      const bool changes = is_bus_off_ != wanted.bus_off_now;
      set_change(changes ? now : next_change(now));
    } else if (other_times) {
      set_change(is_bus_off_ ? next_change(now) : after(now, faults_.bus_off));
    }
  }

  // Enters bus-off, or returns from it.
  void change_state(can_bridge::BusEvents& events, Instant now) {
    if (now < change_at_) {
      return;
    }
    is_bus_off_ = !is_bus_off_;
    shared_->bus.set_connected(self_.endpoint, !is_bus_off_, now);
    change_at_ = next_change(now);
    BusEvent event;
    event.kind = BusEvent::Kind::state;
    event.state = is_bus_off_ ? BusState::bus_off : BusState::error_active;
    event.time = now;
    events.push(event);
  }

  void report_disturbed(can_bridge::BusEvents& events, Instant now) {
    const std::uint64_t more = shared_->disturbed - disturbed_;
    if (more == 0 || is_bus_off_) {
      return;
    }
    disturbed_ = shared_->disturbed;
    BusEvent event;
    event.kind = BusEvent::Kind::error;
    event.errors = can::kProtocol;
    event.count = static_cast<std::uint32_t>(more);
    event.time = now;
    events.push(event);
  }

  bool submit(const can::Frame& frame, Instant now) {
    if (!can_bridge::sendable(frame, true)) {
      ++counters_.refused;
      return true;
    }
    if (!shared_->bus.submit(self_.endpoint, frame, now)) {
      return false;
    }
    ++counters_.sent;
    return true;
  }

  // The lost frames precede all remaining ones; `then` is the time of the first remaining frame.
  void report_lost(std::uint64_t lost, can_bridge::BusEvents& events, Instant then) {
    if (lost == 0) {
      return;
    }
    counters_.lost += lost;
    BusEvent event;
    event.kind = BusEvent::Kind::frames_lost;
    event.count = static_cast<std::uint32_t>(lost);
    event.time = then;
    events.push(event);
  }

  std::shared_ptr<SharedBus> shared_;
  Member self_;
  Instant retry_at_{};
  bool failed_ = false;
  can_bridge::VirtualFaults faults_;  // of this endpoint: bus_off and restart
  Instant change_at_ = kNever;        // next change into bus-off or back
  bool is_bus_off_ = false;
  std::uint64_t disturbed_ = 0;  // number already reported
  can_bridge::ChannelCounters counters_;
};

}  // namespace

struct VirtualNetwork::Impl {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<SharedBus>, std::less<>> buses;
};

VirtualNetwork::VirtualNetwork() : impl_(std::make_unique<Impl>()) {
}
VirtualNetwork::~VirtualNetwork() = default;

std::unique_ptr<can_bridge::Channel> VirtualNetwork::open(std::string_view name,
                                                          const BusOptions& options,
                                                          const can_bridge::VirtualFaults& faults) {
  const std::scoped_lock lock(impl_->mutex);
  auto found = impl_->buses.find(name);
  if (found == impl_->buses.end()) {
    found = impl_->buses.emplace(std::string(name), std::make_shared<SharedBus>(options)).first;
  }
  return std::make_unique<VirtualChannel>(found->second, faults);
}

}  // namespace linegate::sim
