// SPDX-License-Identifier: Apache-2.0
// Notifications to the service manager: a fake one receives them, and a test blocks a thread on
// purpose.
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "gateway/process/background.h"
#include "gateway/process/progress_watch.h"
#include "gateway/process/service_manager.h"
#include "gateway/process/status_text.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/runner.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

constexpr int kNotifyPatience = 10'000;  // ms

// --- sd_notify --------------------------------------------------------------------------------

class FakeServiceManager {
 public:
  FakeServiceManager() {
    // A name in the abstract namespace leaves no file behind.
    const std::string name = "linegate-test-notify-" + std::to_string(getpid());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0);
    setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
  }
  ~FakeServiceManager() {
    unsetenv("NOTIFY_SOCKET");
    close(socket_);
  }
  FakeServiceManager(const FakeServiceManager&) = delete;
  FakeServiceManager& operator=(const FakeServiceManager&) = delete;

  std::string hear() const {
    std::array<char, 512> buffer{};
    const ssize_t n = recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    return n < 0 ? "" : std::string(buffer.data(), static_cast<std::size_t>(n));
  }

 private:
  int socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST(ServiceManager, HearsEachStateInItsOwnWords) {
  const FakeServiceManager fake;
  ServiceManager manager;
  manager.ready();
  EXPECT_EQ(fake.hear(), "READY=1");
  manager.alive();
  EXPECT_EQ(fake.hear(), "WATCHDOG=1");
  manager.status("3 lines in order");
  EXPECT_EQ(fake.hear(), "STATUS=3 lines in order");
  manager.reloading();
  EXPECT_EQ(fake.hear().substr(0, 27), "RELOADING=1\nMONOTONIC_USEC=");
  manager.stopping();
  EXPECT_EQ(fake.hear(), "STOPPING=1");
  EXPECT_EQ(fake.hear(), "");
}

TEST(ServiceManager, WatchesOnlyIfItSaysSo) {
  const ServiceManager manager;
  unsetenv("WATCHDOG_PID");
  unsetenv("WATCHDOG_USEC");
  EXPECT_EQ(manager.watchdog(), 0s);
  setenv("WATCHDOG_USEC", "20000000", 1);
  EXPECT_EQ(manager.watchdog(), 20s);
  setenv("WATCHDOG_PID", "1", 1);
  EXPECT_EQ(manager.watchdog(), 0s) << "the variable is for another process";
  unsetenv("WATCHDOG_PID");
  unsetenv("WATCHDOG_USEC");
}

// --- progress ---------------------------------------------------------------------------------

// Its service() blocks until let_go() is called.
class StickyRunner final : public Runner {
 public:
  StickyRunner(int told, int released) : told_(told), released_(released) {}

  int descriptor() const override { return -1; }
  bool wants_writable() const override { return false; }
  void service(Instant /*now*/) override {
    char byte = 'x';
    EXPECT_EQ(write(told_, &byte, 1), 1);
    EXPECT_EQ(read(released_, &byte, 1), 1);
  }
  Instant next_wake() const override { return kNever; }
  void stop(Instant /*now*/) override {}
  bool stopped(Instant /*now*/) const override { return true; }

 private:
  int told_;
  int released_;
};

class ProgressWatchTest : public testing::Test {
 protected:
  ProgressWatchTest() {
    EXPECT_EQ(pipe(serving_), 0);
    EXPECT_EQ(pipe(release_), 0);
    config::ExecutorPlan plan;
    plan.name = "sticky";
    executor_ = std::make_unique<Executor>(plan);
    executor_->add(std::make_unique<StickyRunner>(serving_[1], release_[0]));
  }
  ~ProgressWatchTest() override {
    executor_->request_stop();
    let_go(2);  // once for this round, and once for the last one
    executor_->join();
    for (const int end : {serving_[0], serving_[1], release_[0], release_[1]}) {
      close(end);
    }
  }

  ProgressWatch watch() {
    return ProgressWatch(
        {{"exec sticky", &executor_->rounds(), [this] { executor_->wakeup().signal(); }}});
  }
  // Waits until the executor is in service() of its runner.
  void await_serving() const {
    char byte = 0;
    pollfd p{serving_[0], POLLIN, 0};
    ASSERT_EQ(poll(&p, 1, kNotifyPatience), 1);
    ASSERT_EQ(read(serving_[0], &byte, 1), 1);
  }
  void let_go(std::size_t times) const {
    EXPECT_EQ(write(release_[1], "xxxxxxxx", times), static_cast<ssize_t>(times));
  }

  int serving_[2] = {-1, -1};
  int release_[2] = {-1, -1};
  std::unique_ptr<Executor> executor_;
};

TEST_F(ProgressWatchTest, NamesAThreadThatDoesNotComeBackUntilItDoes) {
  const std::vector<std::string> nobody;
  const std::vector<std::string> sticky{"exec sticky"};
  ProgressWatch watch = this->watch();
  executor_->start();
  await_serving();
  EXPECT_FALSE(watch.all_started());
  EXPECT_EQ(watch.look(), nobody) << "the thread was not woken by the watch yet";
  EXPECT_EQ(watch.look(), sticky);
  EXPECT_EQ(watch.look(), sticky);
  let_go(1);
  await_serving();  // woken by the watch, the executor has started the next round
  EXPECT_TRUE(watch.all_started());
  EXPECT_EQ(watch.look(), nobody);
  EXPECT_EQ(watch.look(), sticky);
}

TEST_F(ProgressWatchTest, AThreadThatWaitsIsNotStuck) {
  ProgressWatch watch = this->watch();
  executor_->start();
  await_serving();
  let_go(1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(watch.look().empty());
    await_serving();  // only the watch wakes it: the executor is idle otherwise
    const std::uint64_t before = executor_->rounds().value();
    let_go(1);
    while (executor_->rounds().value() == before) {
      sched_yield();
    }
  }
}

// --- reading beside -----------------------------------------------------------------------------

// The service handles signals even while a reload is blocked in reading a file.
TEST(BackgroundTest, IsWaitedForByNobody) {
  int release[2] = {-1, -1};
  ASSERT_EQ(pipe(release), 0);
  const int from = release[0];
  Background background;
  EXPECT_FALSE(background.active());
  background.start([from]() -> Background::Rest {
    char byte = 0;
    const ssize_t count = read(from, &byte, 1);
    return [count] { EXPECT_EQ(count, 1); };
  });
  EXPECT_TRUE(background.active());
  EXPECT_FALSE(background.finished());
  ASSERT_EQ(write(release[1], "x", 1), 1);
  const auto rest = background.finished(1min);
  ASSERT_TRUE(rest);
  (*rest)();
  EXPECT_FALSE(background.active());
  close(release[0]);
  close(release[1]);
}

// --- the status line --------------------------------------------------------------------------

ShownLine line(const char* name, can::BusState bus, int operational, int configured) {
  line::LineState state;
  state.own_state = nmt::State::operational;
  state.bus = bus;
  state.nodes_operational = static_cast<std::uint8_t>(operational);
  state.nodes_configured = static_cast<std::uint8_t>(configured);
  return {name, state};
}

TEST(StatusText, SaysHowManyLinesAreInOrderAndWhatTheOthersLack) {
  const auto good = line("press", can::BusState::error_active, 4, 4);
  EXPECT_EQ(status_text(std::vector{good}), "1 line in order");
  EXPECT_EQ(status_text(std::vector{good, good}), "2 lines in order");

  ShownLine observer = line("plc", can::BusState::error_active, 2, 2);
  observer.state->role = line::Role::observer;
  observer.state->own_state = nmt::State::initialising;
  EXPECT_EQ(status_text(std::vector{observer}), "1 line in order");

  ShownLine waiting = line("pack", can::BusState::unknown, 0, 2);
  waiting.state->own_state = nmt::State::initialising;
  const std::vector<ShownLine> lines{good,
                                     line("hall", can::BusState::error_active, 3, 4),
                                     line("oven", can::BusState::bus_off, 4, 4),
                                     line("gone", can::BusState::absent, 0, 1),
                                     waiting,
                                     {"new", std::nullopt}};
  EXPECT_EQ(status_text(lines),
            "1 of 6 lines in order; hall: 3 of 4 nodes operational; oven: bus-off; gone: absent; "
            "pack: waits for its interface; new: starting");
}

TEST(StatusText, BeginsWithWhatOtherPartsLack) {
  const std::vector lines{line("press", can::BusState::error_active, 4, 4)};
  const std::vector<std::string> complaints{"no progress: exec press",
                                            "DDS process not running, started again in 4 s"};
  EXPECT_EQ(
      status_text(lines, complaints),
      "no progress: exec press; DDS process not running, started again in 4 s; 1 line in order");
}

}  // namespace
}  // namespace linegate::gateway
