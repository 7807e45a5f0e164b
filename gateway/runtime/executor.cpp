// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/executor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "gateway/runtime/clock.h"
#include "gateway/runtime/scheduling.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

constexpr std::uint64_t kWakeup = ~std::uint64_t{0};
constexpr std::uint64_t kTimer = kWakeup - 1;
constexpr std::uint64_t kValues = kWakeup - 2;
constexpr int kEventsAtOnce = 16;

void watch(int epoll, int descriptor, std::uint64_t what, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = what;
  epoll_ctl(epoll, EPOLL_CTL_ADD, descriptor, &event);
}

}  // namespace

Executor::Executor(config::ExecutorPlan plan)
    : plan_(std::move(plan)), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  if (epoll_ < 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_create1");
  }
  watch(epoll_, wakeup_.descriptor(), kWakeup, EPOLLIN | EPOLLET);
  watch(epoll_, values_wakeup_.descriptor(), kValues, EPOLLIN | EPOLLET);
  watch(epoll_, timer_.descriptor(), kTimer, EPOLLIN);
  places_.reserve(kMostChanges);
}

Executor::~Executor() {
  request_stop();
  join();
  close(epoll_);
}

void Executor::add(std::unique_ptr<Runner> runner) {
  LINEGATE_ASSERT(!is_own_thread(), "another thread adds runners");
  if (!thread_.joinable()) {
    place(std::move(runner));
    return;
  }
  while (!arrivals_.push(runner)) {
    std::this_thread::yield();
  }
  wakeup_.signal();
}

void Executor::place(std::unique_ptr<Runner> runner) {
  const auto free = std::find_if(places_.begin(), places_.end(),
                                 [](const Place& place) { return place.runner == nullptr; });
  Place& place = free != places_.end() ? *free : places_.emplace_back();
  place = Place{.runner = std::move(runner), .registered = {}};
}

std::vector<std::unique_ptr<Runner>> Executor::send_away(const std::vector<Runner*>& runners) {
  LINEGATE_ASSERT(thread_.joinable() && !is_own_thread(), "another thread waits for the runners");
  std::vector<std::unique_ptr<Runner>> out;
  std::size_t asked = 0;
  while (out.size() < runners.size()) {
    someone_departed_.clear();
    for (; asked < runners.size() && departures_.room() > 0; ++asked) {
      Runner* runner = runners[asked];
      departures_.push(runner);
    }
    wakeup_.signal();
    for (std::unique_ptr<Runner> runner; departed_.pop(runner);) {
      out.push_back(std::move(runner));
    }
    if (out.size() < runners.size()) {
      pollfd waiting{someone_departed_.descriptor(), POLLIN, 0};
      poll(&waiting, 1, -1);
    }
  }
  return out;
}

void Executor::visit(const std::function<void()>& work) {
  if (!thread_.joinable()) {
    work();
    return;
  }
  LINEGATE_ASSERT(!is_own_thread(), "another thread waits for the work");
  LINEGATE_ASSERT(visits_.push(&work), "there is one visit at a time");
  wakeup_.signal();
  for (Visit over = nullptr;;) {
    visit_over_.clear();
    if (visited_.pop(over)) {
      return;
    }
    pollfd waiting{visit_over_.descriptor(), POLLIN, 0};
    poll(&waiting, 1, -1);
  }
}

[[gnu::hot]] void Executor::receive_visits() {
  for (Visit work = nullptr; visits_.pop(work);) {
    (*work)();
    LINEGATE_ASSERT(visited_.push(work), "there is one visit at a time");
    visit_over_.signal();
  }
}

void Executor::start() {
  if (!thread_.joinable()) {
    thread_ = std::thread([this] { run(); });
  }
}

void Executor::request_stop() {
  stop_.raise();
  wakeup_.signal();
}

void Executor::join() {
  if (thread_.joinable()) {
    thread_.join();
  }
}

[[gnu::hot]] void Executor::run() {
  pthread_setname_np(pthread_self(), ("exec " + plan_.name).substr(0, 15).c_str());
  apply_scheduling(plan_);
  bool stopping = false;
  for (;;) {
    const Instant now = monotonic_now();
    if (std::exchange(woken_, false)) {
      poll_changes(now);
      receive_visits();
    }
    if (stop_.raised() && !stopping) {
      stopping = true;
      for (auto& place : places_) {
        if (place.runner != nullptr) {
          place.runner->stop(now);
        }
      }
    }
    for (std::size_t i = 0; i < places_.size(); ++i) {
      serve(i, now);
    }
    announce();
    if (leaving_ > 0) {
      let_go(now);
    }
    rounds_.add();
    if (stopping && all_stopped(now)) {
      return;
    }
    Instant until = kNever;
    for (const auto& place : places_) {
      if (place.runner != nullptr) {
        until = earlier(until, place.runner->next_wake());
      }
    }
    wait(until, now);
  }
}

[[gnu::hot]] void Executor::poll_changes(Instant now) {
  for (std::unique_ptr<Runner> runner; arrivals_.pop(runner);) {
    place(std::move(runner));
  }
  for (Runner* runner = nullptr; departures_.pop(runner);) {
    const auto of = std::ranges::find_if(
        places_, [&](const Place& place) { return place.runner.get() == runner; });
    LINEGATE_ASSERT(of != places_.end() && !of->leaving, "the runner is here, and leaves once");
    of->leaving = true;
    ++leaving_;
    runner->stop(now);
  }
}

void Executor::let_go(Instant now) {
  for (Place& place : places_) {
    if (!place.leaving || !place.runner->stopped(now) || departed_.room() == 0) {
      continue;
    }
    if (place.registered.descriptor >= 0) {
      epoll_ctl(epoll_, EPOLL_CTL_DEL, place.registered.descriptor, nullptr);
    }
    LINEGATE_ASSERT(departed_.push(place.runner), "there is room for the runner");
    place = Place{};
    --leaving_;
    someone_departed_.signal();
  }
}

[[gnu::hot]] void Executor::serve(std::size_t i, Instant now) {
  Place& place = places_[i];
  if (place.runner == nullptr || (!place.ready && place.runner->next_wake() > now)) {
    return;
  }
  place.ready = false;
  if (!std::exchange(place.readable, false) && place.registered.descriptor >= 0) {
    place.runner->nothing_to_read();
  }
  if (std::exchange(place.called, false)) {
    place.runner->called();
  }
  place.runner->service(now);
  place.served = true;
  update_interest(i);
}

[[gnu::hot]] void Executor::announce() {
  exchange::Wakeup* waiting = nullptr;
  for (Place& place : places_) {
    exchange::Wakeup* const next =
        std::exchange(place.served, false) ? place.runner->announce() : nullptr;
    if (next == nullptr || next == waiting) {
      continue;
    }
    if (waiting != nullptr) {
      waiting->signal();
    }
    waiting = next;
  }
  if (waiting != nullptr) {
    waiting->signal();
  }
}

[[gnu::hot]] void Executor::update_interest(std::size_t i) {
  Registered& was = places_[i].registered;
  const Runner& runner = *places_[i].runner;
  const Registered is{runner.descriptor(), runner.wants_writable()};
  if (is.descriptor == was.descriptor && is.writable == was.writable) {
    return;
  }
  epoll_event event{};
  event.events = EPOLLIN | (is.writable ? std::uint32_t{EPOLLOUT} : 0U);
  event.data.u64 = i;
  if (is.descriptor >= 0) {
    const int operation = is.descriptor == was.descriptor ? EPOLL_CTL_MOD : EPOLL_CTL_ADD;
    epoll_ctl(epoll_, operation, is.descriptor, &event);
  }
  // A closed descriptor has left the epoll set by itself.
  was = is;
}

// A timer that has expired since `now` wakes at once.
[[gnu::hot]] void Executor::wait(Instant until, Instant now) {
  constexpr Duration kLongest = std::chrono::seconds(10);
  if (until > now) {
    timer_.wake_at(std::min(until, now + kLongest), now);
  }
  std::array<epoll_event, kEventsAtOnce> events;
  const int count = epoll_wait(epoll_, events.data(), kEventsAtOnce, until > now ? -1 : 0);
  for (int k = 0; k < count; ++k) {
    note_event(events[static_cast<std::size_t>(k)].data.u64);
  }
  if (count == kEventsAtOnce) [[unlikely]] {  // there may be more
    for (Place& place : places_) {
      place.readable = true;
    }
  }
}

[[gnu::hot]] void Executor::note_event(std::uint64_t what) {
  if (what == kWakeup) {
    wakeup_.clear_edge();
    woken_ = true;
    for (Place& place : places_) {
      place.ready = true;
      place.called = true;
    }
  } else if (what == kValues) {
    values_wakeup_.clear_edge();
    for (Place& place : places_) {
      place.ready |= place.runner != nullptr && place.runner->has_values();
    }
  } else if (what != kTimer) {
    LINEGATE_ASSERT(what < places_.size(), "the descriptor is that of a runner");
    places_[what].ready = true;
    places_[what].readable = true;
  }
}

bool Executor::all_stopped(Instant now) const {
  return std::all_of(places_.begin(), places_.end(), [&](const Place& place) {
    return place.runner == nullptr || place.runner->stopped(now);
  });
}

}  // namespace linegate::gateway
