// SPDX-License-Identifier: Apache-2.0
// Real threads on socket pairs: the test is the peer of each channel.
#include "gateway/runtime/executor.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/capability.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "bridges/can/socketcan.h"
#include "gateway/runtime/line_runner.h"
#include "gateway/runtime/scheduling.h"

#include "tests/gateway/log_keeper.h"
#include "tests/gateway/plans.h"

namespace linegate::gateway {
namespace {

constexpr int kPatience = 10'000;  // ms; a test that waits so long has failed

class Wire {
 public:
  Wire() {
    int ends[2] = {-1, -1};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends), 0);
    mine_ = ends[0];
    channel_ = can_bridge::open_on_descriptor(ends[1]);
  }
  ~Wire() { close(mine_); }

  std::unique_ptr<can_bridge::Channel> channel() { return std::move(channel_); }

  void send(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can_frame frame{};
    frame.can_id = id;
    for (const std::uint8_t byte : data) {
      frame.data[frame.can_dlc++] = byte;
    }
    EXPECT_EQ(write(mine_, &frame, sizeof frame), static_cast<ssize_t>(sizeof frame));
  }
  // Waits for a frame with that identifier.
  bool expect(std::uint32_t id) {
    for (;;) {
      pollfd p{mine_, POLLIN, 0};
      if (poll(&p, 1, kPatience) != 1) {
        return false;
      }
      can_frame frame{};
      if (read(mine_, &frame, sizeof frame) > 0 && frame.can_id == id) {
        return true;
      }
    }
  }

 private:
  int mine_ = -1;
  std::unique_ptr<can_bridge::Channel> channel_;
};

// The first processor on which this process may run.
unsigned first_processor() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  EXPECT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  unsigned processor = 0;
  while (processor < CPU_SETSIZE - 1 && !CPU_ISSET(processor, &allowed)) {
    ++processor;
  }
  return processor;
}

class ExecutorTest : public testing::Test {
 protected:
  ExecutorTest()
      : plant_(make_plant("schema: 1\n"
                          "lines:\n"
                          "  - {name: a, interface: 'virtual:a', nodes: &n [{id: 5, eds: "
                          "bridges/sim/eds/digital-io.eds}]}\n"
                          "  - {name: b, interface: 'virtual:b', nodes: *n}\n")) {}

  std::unique_ptr<LineRunner> runner(std::size_t i, std::unique_ptr<can_bridge::Channel> channel) {
    return std::make_unique<LineRunner>(make_line(plant_.lines.at(i)), std::move(channel),
                                        plant_.lines.at(i), ports_[i], consumer_);
  }
  // Waits for an event of that kind from line i.
  bool expect(std::size_t i, EventKind kind) {
    for (;;) {
      consumer_.clear();
      for (Event event; ports_[i].events.pop(event);) {
        if (event.kind() == kind) {
          return true;
        }
      }
      pollfd p{consumer_.descriptor(), POLLIN, 0};
      if (poll(&p, 1, kPatience) != 1) {
        return false;
      }
    }
  }

  config::Plant plant_;
  LinePort ports_[2];
  exchange::Wakeup consumer_;
};

TEST_F(ExecutorTest, RunsALineOverASocket) {
  Wire wire;
  Executor executor({});
  executor.add(runner(0, wire.channel()));
  executor.start();
  EXPECT_TRUE(wire.expect(0x000)) << "reset of all nodes";
  wire.send(0x705, {0});
  EXPECT_TRUE(expect(0, EventKind::boot_up));
  EXPECT_TRUE(wire.expect(0x605)) << "the manager reads 1000h";
  executor.request_stop();
  executor.join();
  EXPECT_TRUE(expect(0, EventKind::line_stopped));
}

TEST_F(ExecutorTest, RunsTwoLinesOnOneThread) {
  Wire wires[2];
  Executor executor({});
  executor.add(runner(0, wires[0].channel()));
  executor.add(runner(1, wires[1].channel()));
  executor.start();
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(wires[i].expect(0x000));
    wires[i].send(0x705, {0});
    EXPECT_TRUE(expect(i, EventKind::boot_up));
    EXPECT_TRUE(wires[i].expect(0x605));
  }
}

TEST_F(ExecutorTest, RunsTheOthersWhenOneInterfaceIsMissing) {
  Wire wire;
  Executor executor({});
  executor.add(runner(0, can_bridge::open_socketcan("nosuchcan9", {})));
  executor.add(runner(1, wire.channel()));
  executor.start();
  EXPECT_TRUE(expect(0, EventKind::interface_failed));
  EXPECT_TRUE(wire.expect(0x000));
  wire.send(0x705, {0});
  EXPECT_TRUE(expect(1, EventKind::boot_up));
}

TEST_F(ExecutorTest, AnswersACommandThatCameThroughTheRing) {
  Wire wire;
  Executor executor({});
  executor.add(runner(0, wire.channel()));
  executor.start();
  EXPECT_TRUE(wire.expect(0x000));
  line::Command command{.tag = 42, .request = line::LocalRead{.what = od::Address{0x1000, 0}}};
  ASSERT_TRUE(ports_[0].commands.push(command));
  executor.wakeup().signal();
  line::Reply reply;
  for (;;) {
    consumer_.clear();
    if (ports_[0].replies.pop(reply)) {
      break;
    }
    pollfd p{consumer_.descriptor(), POLLIN, 0};
    ASSERT_EQ(poll(&p, 1, kPatience), 1);
  }
  EXPECT_EQ(reply.tag, 42U);
  EXPECT_TRUE(reply.ok());
  EXPECT_EQ(reply.bytes().size(), 4U);
}

TEST_F(ExecutorTest, TakesAndGivesBackRunnersWhileAnotherGoesOn) {
  Wire wires[2];
  Executor executor({});
  executor.add(runner(0, wires[0].channel()));
  executor.start();
  EXPECT_TRUE(wires[0].expect(0x000));
  for (int i = 0; i < 2; ++i) {
    Wire wire;
    auto coming = runner(1, wire.channel());
    Runner* const known = coming.get();
    executor.add(std::move(coming));
    EXPECT_TRUE(wire.expect(0x000)) << "reset of all nodes";
    wire.send(0x705, {0});
    EXPECT_TRUE(expect(1, EventKind::boot_up));
    const auto gone = executor.send_away({known});
    ASSERT_EQ(gone.size(), 1U);
    EXPECT_EQ(gone[0].get(), known);
    EXPECT_TRUE(expect(1, EventKind::line_stopped)) << "the line was stopped properly";
    wire.send(0x705, {0});  // has no receiver, and does no harm
  }
  EXPECT_TRUE(executor.send_away({}).empty());
  wires[0].send(0x705, {0});
  EXPECT_TRUE(expect(0, EventKind::boot_up));
  EXPECT_TRUE(wires[0].expect(0x605));
}

TEST_F(ExecutorTest, AVisitIsOnItsThreadAndOverWhenItReturns) {
  Executor executor({});
  std::thread::id where;
  executor.visit([&] { where = std::this_thread::get_id(); });
  EXPECT_EQ(where, std::this_thread::get_id())
      << "not started: the visit runs on the calling thread";
  executor.start();
  int visits = 0;
  for (int i = 1; i <= 100; ++i) {
    executor.visit([&] {
      where = std::this_thread::get_id();
      ++visits;
    });
    ASSERT_EQ(visits, i);
    ASSERT_NE(where, std::this_thread::get_id());
  }
}

TEST_F(ExecutorTest, ARunnerIsCalledWhenSomebodyWakesTheExecutorAndForFramesItIsNot) {
  // Records the calls of the executor's thread since the last service().
  class Telling final : public Runner {
   public:
    Telling(int frames, int told) : frames_(frames), told_(told) {}
    int descriptor() const override { return frames_; }
    bool wants_writable() const override { return false; }
    void service(Instant /*now*/) override {
      char frame = 0;
      const bool received = read(frames_, &frame, 1) == 1;
      const std::string said = std::exchange(called_, false) ? "called" : received ? "frame" : "";
      EXPECT_EQ(write(told_, said.data(), said.size()), static_cast<ssize_t>(said.size()));
    }
    void called() override { called_ = true; }
    Instant next_wake() const override { return kNever; }
    void stop(Instant /*now*/) override {}
    bool stopped(Instant /*now*/) const override { return true; }

   private:
    int frames_;
    int told_;
    bool called_ = false;
  };
  int frames[2] = {-1, -1};
  int told[2] = {-1, -1};
  ASSERT_EQ(pipe2(frames, O_NONBLOCK), 0);
  ASSERT_EQ(pipe(told), 0);
  const auto next = [&] {
    std::array<char, 16> said{};
    pollfd p{told[0], POLLIN, 0};
    EXPECT_EQ(poll(&p, 1, kPatience), 1);
    const ssize_t n = read(told[0], said.data(), said.size());
    return std::string(said.data(), static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
  };
  {
    Executor executor({});
    executor.add(std::make_unique<Telling>(frames[0], told[1]));
    executor.start();
    EXPECT_EQ(next(), "called") << "signalled before the executor started";
    ASSERT_EQ(write(frames[1], "x", 1), 1);
    EXPECT_EQ(next(), "frame");
    executor.wakeup().signal();
    EXPECT_EQ(next(), "called");
    ASSERT_EQ(write(frames[1], "x", 1), 1);
    EXPECT_EQ(next(), "frame");
  }
  for (const int descriptor : {frames[0], frames[1], told[0], told[1]}) {
    close(descriptor);
  }
}

// Records why the executor's thread serves it.
class ReasonRunner final : public Runner {
 public:
  ReasonRunner(int frames, int log, exchange::Handover<int>& values, std::string name)
      : frames_(frames), log_(log), values_(values), name_(std::move(name)) {}
  int descriptor() const override { return frames_; }
  bool wants_writable() const override { return false; }
  void nothing_to_read() override { nothing_to_read_ = true; }
  bool has_values() const override { return values_.fresh(); }
  void called() override { called_ = true; }
  void service(Instant /*now*/) override {
    std::string said = name_;
    said += std::exchange(called_, false) ? " called" : "";
    said += values_.fetch() != nullptr ? " values" : "";
    char frame = 0;
    if (!std::exchange(nothing_to_read_, false)) {
      said += read(frames_, &frame, 1) == 1 ? " frame" : " no frame";
    }
    EXPECT_EQ(write(log_, said.data(), said.size()), static_cast<ssize_t>(said.size()));
  }
  Instant next_wake() const override { return kNever; }
  void stop(Instant /*now*/) override {}
  bool stopped(Instant /*now*/) const override { return true; }

 private:
  int frames_;
  int log_;
  exchange::Handover<int>& values_;
  std::string name_;
  bool nothing_to_read_ = false;
  bool called_ = false;
};

TEST_F(ExecutorTest, AWakeUpForValuesServesOnlyTheRunnersThatHaveSome) {
  std::array<std::array<int, 2>, 2> frames{};
  std::array<exchange::Handover<int>, 2> values;
  int log[2] = {-1, -1};
  ASSERT_EQ(pipe2(log, O_DIRECT), 0);  // each write is a packet
  for (std::array<int, 2>& pipe_of : frames) {
    ASSERT_EQ(pipe2(pipe_of.data(), O_NONBLOCK), 0);
  }
  const auto next = [&] {
    std::array<char, 64> said{};
    pollfd p{log[0], POLLIN, 0};
    EXPECT_EQ(poll(&p, 1, kPatience), 1);
    const ssize_t n = read(log[0], said.data(), said.size());
    return std::string(said.data(), static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
  };
  {
    Executor executor({});
    for (std::size_t i = 0; i < 2; ++i) {
      executor.add(std::make_unique<ReasonRunner>(frames[i][0], log[1], values[i],
                                                  std::string(1, static_cast<char>('a' + i))));
    }
    executor.start();
    EXPECT_EQ(next(), "a called no frame");
    EXPECT_EQ(next(), "b called no frame");
    for (int i = 0; i < 3; ++i) {
      values[1].draft().value = i;
      values[1].publish();
      executor.values_wakeup().signal();
      EXPECT_EQ(next(), "b values");
    }
    ASSERT_EQ(write(frames[1][1], "x", 1), 1);
    EXPECT_EQ(next(), "b frame");
    executor.wakeup().signal();
    EXPECT_EQ(next(), "a called");
    EXPECT_EQ(next(), "b called");
  }
  for (const std::array<int, 2>& pipe_of : frames) {
    close(pipe_of[0]);
    close(pipe_of[1]);
  }
  close(log[0]);
  close(log[1]);
}

// Leaves data for a consumer in each round, and records whether the consumer had been woken before.
class AnnouncingRunner final : public Runner {
 public:
  AnnouncingRunner(exchange::Wakeup& consumer, int log) : consumer_(consumer), log_(log) {}
  int descriptor() const override { return -1; }
  bool wants_writable() const override { return false; }
  void service(Instant /*now*/) override {}
  exchange::Wakeup* announce() override {
    pollfd p{consumer_.descriptor(), POLLIN, 0};
    const char woken = poll(&p, 1, 0) == 1 ? 'w' : '-';
    EXPECT_EQ(write(log_, &woken, 1), 1);
    return &consumer_;
  }
  Instant next_wake() const override { return kNever; }
  void stop(Instant /*now*/) override {}
  bool stopped(Instant /*now*/) const override { return true; }

 private:
  exchange::Wakeup& consumer_;
  int log_;
};

TEST_F(ExecutorTest, WakesAConsumerOnceForAllRunnersOfARound) {
  exchange::Wakeup shared;
  exchange::Wakeup other;
  int log[2] = {-1, -1};
  ASSERT_EQ(pipe(log), 0);
  {
    Executor executor({});
    executor.add(std::make_unique<AnnouncingRunner>(shared, log[1]));
    executor.add(std::make_unique<AnnouncingRunner>(shared, log[1]));
    executor.add(std::make_unique<AnnouncingRunner>(other, log[1]));
    executor.start();
    for (exchange::Wakeup* consumer : {&shared, &other}) {
      pollfd p{consumer->descriptor(), POLLIN, 0};
      EXPECT_EQ(poll(&p, 1, kPatience), 1) << "each consumer is woken";
    }
  }
  std::array<char, 3> woken{};
  ASSERT_EQ(read(log[0], woken.data(), woken.size()), static_cast<ssize_t>(woken.size()));
  EXPECT_EQ(std::string(woken.data(), woken.size()), "---") << "before all runners had their turn";
  close(log[0]);
  close(log[1]);
}

TEST_F(ExecutorTest, RunsWithThePriorityOnTheProcessorThatThePlanNames) {
  struct Told {
    int policy = -1;
    sched_param parameter{};
    cpu_set_t processors{};
  };
  // Records the scheduling parameters of the thread that runs it.
  class Asking final : public Runner {
   public:
    Asking(Told& told, int done) : told_(told), done_(done) {}
    int descriptor() const override { return -1; }
    bool wants_writable() const override { return false; }
    void service(Instant /*now*/) override {
      pthread_getschedparam(pthread_self(), &told_.policy, &told_.parameter);
      pthread_getaffinity_np(pthread_self(), sizeof told_.processors, &told_.processors);
      EXPECT_EQ(write(done_, "x", 1), 1);
    }
    Instant next_wake() const override { return kNever; }
    void stop(Instant /*now*/) override {}
    bool stopped(Instant /*now*/) const override { return true; }

   private:
    Told& told_;
    int done_;
  };
  int done[2] = {-1, -1};
  ASSERT_EQ(pipe(done), 0);
  Told told;
  LogKeeper log;
  config::ExecutorPlan plan;
  plan.name = "fast";
  plan.priority = 7;
  plan.processor = first_processor();
  {
    Executor executor(plan);
    executor.add(std::make_unique<Asking>(told, done[1]));
    executor.start();
    pollfd p{done[0], POLLIN, 0};
    ASSERT_EQ(poll(&p, 1, kPatience), 1);
  }
  close(done[0]);
  close(done[1]);
  EXPECT_EQ(CPU_COUNT(&told.processors), 1);
  EXPECT_TRUE(CPU_ISSET(*plan.processor, &told.processors));
  // Either the setting is in effect, or its failure was reported.
  const bool real_time = told.policy == SCHED_FIFO && told.parameter.sched_priority == 7;
  const auto lines = log.lines();
  const bool warned = std::find(lines.begin(), lines.end(),
                                "warning executor fast: real-time priority is not permitted "
                                "(Operation not permitted); it runs without") != lines.end();
  EXPECT_NE(real_time, warned);
}

TEST_F(ExecutorTest, LocksNoMemoryUnderALimitThatCouldEndTheGateway) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_MEMLOCK, &before), 0);
  rlimit limited = before;
  // Large enough, but a limit.
  limited.rlim_cur = std::min<rlim_t>(before.rlim_max, rlim_t{1} << 40U);
  ASSERT_EQ(setrlimit(RLIMIT_MEMLOCK, &limited), 0);
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> capabilities{};
  ASSERT_EQ(syscall(SYS_capget, &header, capabilities.data()), 0);
  auto without = capabilities;
  for (auto& part : without) {
    part.effective = 0;
  }
  ASSERT_EQ(syscall(SYS_capset, &header, without.data()), 0);  // applies to this thread
  {
    LogKeeper log;
    config::ExecutorPlan plan;
    plan.name = "fast";
    plan.lock_memory = true;
    apply_scheduling(plan);
    EXPECT_EQ(log.lines(),
              std::vector<std::string>{"warning executor fast: locked memory is not permitted "
                                       "(Operation not permitted); it runs without"});
  }
  EXPECT_EQ(syscall(SYS_capset, &header, capabilities.data()), 0);
  EXPECT_EQ(setrlimit(RLIMIT_MEMLOCK, &before), 0);
}

TEST_F(ExecutorTest, GoesOnWithoutSchedulingThatIsNotPermitted) {
  Wire wire;
  config::ExecutorPlan plan;
  plan.name = "fast";
  plan.processor = 1023;  // does not exist on this machine
  Executor executor(plan);
  executor.add(runner(0, wire.channel()));
  executor.start();
  EXPECT_TRUE(wire.expect(0x000));
}

}  // namespace
}  // namespace linegate::gateway
