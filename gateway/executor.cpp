#include "gateway/executor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>
#include <utility>

#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "gateway/clock.h"

namespace linegate::gateway {
namespace {

constexpr std::uint64_t kWakeup = ~std::uint64_t{0};
constexpr int kEventsAtOnce = 16;

// epoll_wait in nanoseconds; in milliseconds where the kernel is older than 5.11.
int wait_for(int epoll, epoll_event* events, Duration timeout) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(timeout);
  const timespec ts{static_cast<std::time_t>(seconds.count()),
                    static_cast<long>((timeout - seconds).count())};
  const int n = epoll_pwait2(epoll, events, kEventsAtOnce, &ts, nullptr);
  if (n >= 0 || errno != ENOSYS) {
    return n;
  }
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
  return epoll_wait(epoll, events, kEventsAtOnce, static_cast<int>(std::min<long>(ms, 1000)));
}

}  // namespace

Executor::Executor(config::ExecutorPlan plan)
    : plan_(std::move(plan)), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  if (epoll_ < 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_create1");
  }
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = kWakeup;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, wakeup_.descriptor(), &event);
}

Executor::~Executor() {
  request_stop();
  join();
  close(epoll_);
}

void Executor::add(std::unique_ptr<Runner> runner) {
  runners_.push_back(std::move(runner));
  registered_.emplace_back();
  ready_.push_back(1);
}

void Executor::start() {
  thread_ = std::thread([this] { run(); });
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

void Executor::run() {
  apply_scheduling();
  bool stopping = false;
  for (;;) {
    const Instant now = monotonic_now();
    if (stop_.raised() && !stopping) {
      stopping = true;
      for (auto& runner : runners_) {
        runner->stop(now);
      }
    }
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      serve(i, now);
    }
    rounds_.add();
    if (stopping && all_stopped(now)) {
      return;
    }
    Instant until = kNever;
    for (const auto& runner : runners_) {
      until = earlier(until, runner->next_wake());
    }
    wait(until);
  }
}

void Executor::serve(std::size_t i, Instant now) {
  if (ready_[i] == 0 && runners_[i]->next_wake() > now) {
    return;
  }
  ready_[i] = 0;
  runners_[i]->service(now);
  update_interest(i);
}

void Executor::update_interest(std::size_t i) {
  Registered& was = registered_[i];
  const Registered is{runners_[i]->descriptor(), runners_[i]->wants_writable()};
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
  // One that is gone was closed, and with that has left the epoll set.
  was = is;
}

void Executor::wait(Instant until) {
  constexpr Duration kLongest = std::chrono::seconds(10);
  const Instant now = monotonic_now();
  const Duration left = until <= now      ? Duration::zero()
                        : until == kNever ? kLongest
                                          : std::min(kLongest, until - now);
  std::array<epoll_event, kEventsAtOnce> events{};
  const int count = wait_for(epoll_, events.data(), left);
  for (int k = 0; k < count; ++k) {
    const std::uint64_t what = events[static_cast<std::size_t>(k)].data.u64;
    if (what == kWakeup) {
      wakeup_.clear();
      std::fill(ready_.begin(), ready_.end(), char{1});
    } else {
      ready_[what] = 1;
    }
  }
}

bool Executor::all_stopped(Instant now) const {
  return std::all_of(runners_.begin(), runners_.end(),
                     [&](const auto& runner) { return runner->stopped(now); });
}

void Executor::apply_scheduling() {
  pthread_setname_np(pthread_self(), ("exec " + plan_.name).substr(0, 15).c_str());
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  const auto tell = [&](const char* what, int error) {
    spdlog::warn("executor {}: {} is not permitted ({}); it runs without", plan_.name, what,
                 std::strerror(error));
  };
  if (plan_.priority > 0) {
    const sched_param parameter{plan_.priority};
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter)) {
      tell("real-time priority", error);
    }
  }
  if (plan_.processor) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(*plan_.processor, &set);
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set)) {
      tell("its processor", error);
    }
  }
  if (plan_.lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    tell("locked memory", errno);
  }
}

}  // namespace linegate::gateway
