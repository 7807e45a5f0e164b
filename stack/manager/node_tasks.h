// SPDX-License-Identifier: Apache-2.0
// Work that consists of SDO transfers with one node, one after the other: at most one task for each
// node, those of several nodes at the same time.
//
// A task says what it wants next and is told what came of it; here is everything that has to do
// with the arbiter and with time.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/od/stream.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

// One transfer of a task.
struct TaskStep {
  od::Address address;
  bool write = false;
  std::vector<std::byte> data{};     // to be written
  od::ByteSource* source = nullptr;  // instead of data
  Duration timeout{};                // for each answer of the node; 0 = that of the tasks
  Duration after{};                  // so long after the end of the step before
};

// Task has
//   std::uint8_t node() const;
//   std::optional<TaskStep> wanted();  asked once for each step; nothing: the task has ended
//   void take(AbortCode, std::span<const std::byte> data);  of the step
//   static constexpr sdo::Priority kPriority; static constexpr unsigned kRepeats;
template <class Task>
class NodeTasks final : public sdo::TransferOwner {
 public:
  // timeout: for each answer. sdo must outlive it.
  NodeTasks(sdo::Arbiter& sdo, Duration timeout) : sdo_(sdo), timeout_(timeout) {}
  ~NodeTasks() override { sdo_.disown(*this); }

  // Precondition: !busy(task->node()).
  void begin(std::unique_ptr<Task> task, Instant now) {
    LINEGATE_ASSERT(!busy(task->node()), "a node has one task at a time");
    std::unique_ptr<Running>& running = running_[task->node()];
    running = std::make_unique<Running>();
    running->task = std::move(task);
    ++count_;
    next(running, now);
  }
  bool busy(std::uint8_t node) const { return running_[node] != nullptr; }
  bool idle() const { return count_ == 0; }
  // nullptr if there is none.
  const Task* find(std::uint8_t node) const {
    return running_[node] != nullptr ? running_[node]->task.get() : nullptr;
  }

  // Gives the task back as far as it came; nullptr if there is none.
  std::unique_ptr<Task> cancel(std::uint8_t node) {
    std::unique_ptr<Running> running = std::move(running_[node]);
    if (running == nullptr) {
      return nullptr;
    }
    --count_;
    if (running->transfer != 0) {
      sdo_.cancel(*this, node, running->transfer);
    }
    return std::move(running->task);
  }

  // sdo::TransferOwner
  void completed(sdo::Completion& completion, Instant now) override {
    std::unique_ptr<Running>& running = running_[completion.node];
    if (running != nullptr && running->transfer == completion.number) {
      running->transfer = 0;
      running->task->take(completion.abort, completion.data);
      next(running, now);
    }
  }

  void advance(Instant now) {
    if (now < wake_) {
      return;
    }
    wake_ = kNever;
    for (std::unique_ptr<Running>& running : running_) {
      if (running == nullptr || running->wake == kNever) {
        continue;
      }
      if (running->wake <= now) {
        running->wake = kNever;
        submit(*running, now);
      } else {
        wake_ = earlier(wake_, running->wake);
      }
    }
  }
  // Never later than what is due; may be earlier.
  Instant next_wake() const { return wake_; }

  // The oldest task that has ended and was not yet taken; nullptr if there is none.
  std::unique_ptr<Task> take_ended() {
    if (ended_.empty()) {
      return nullptr;
    }
    std::unique_ptr<Task> out = std::move(ended_.front());
    ended_.pop_front();
    return out;
  }

 private:
  // A node whose queue is full of commands is asked again when some of them are done.
  static constexpr Duration kQueueFull = std::chrono::seconds(1);

  struct Running {
    std::unique_ptr<Task> task;
    TaskStep step;
    std::uint64_t transfer = 0;  // under way; 0 = none
    Instant wake = kNever;       // when the step is to begin
  };

  void next(std::unique_ptr<Running>& running, Instant now) {
    std::optional<TaskStep> step = running->task->wanted();
    if (!step) {
      ended_.push_back(std::move(running->task));
      running.reset();
      --count_;
      return;
    }
    running->step = *std::move(step);
    if (running->step.after > Duration::zero()) {
      wait(*running, now + running->step.after);
    } else {
      submit(*running, now);
    }
  }

  void submit(Running& running, Instant now) {
    LINEGATE_ASSERT(running.transfer == 0, "a task has one transfer at a time");
    const TaskStep& step = running.step;
    running.transfer = ++sequence_;
    sdo::Request request{.owner = this,
                         .number = running.transfer,
                         .node = running.task->node(),
                         .address = step.address,
                         .write = step.write,
                         .data = step.data,
                         .source = step.source,
                         .timeout = step.timeout > Duration::zero() ? step.timeout : timeout_,
                         .priority = Task::kPriority,
                         .options = {.repeats = Task::kRepeats}};
    if (!sdo_.submit(std::move(request), now)) {
      running.transfer = 0;
      wait(running, now + kQueueFull);
    }
  }

  void wait(Running& running, Instant until) {
    running.wake = until;
    wake_ = earlier(wake_, until);
  }

  sdo::Arbiter& sdo_;
  Duration timeout_;
  std::array<std::unique_ptr<Running>, 128> running_;  // by node-ID
  std::size_t count_ = 0;
  std::deque<std::unique_ptr<Task>> ended_;
  std::uint64_t sequence_ = 0;
  Instant wake_ = kNever;
};

}  // namespace linegate::manager
