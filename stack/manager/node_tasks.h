// SPDX-License-Identifier: Apache-2.0
// Tasks that consist of consecutive SDO transfers with one node: at most one task for each node,
// tasks of several nodes at the same time.
//
// A task returns its next transfer and takes the result; NodeTasks handles the arbiter and the
// times.
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
  std::vector<std::byte> data{};     // the value to write
  od::ByteSource* source = nullptr;  // instead of data
  Duration timeout{};                // for each answer of the node; 0 = the default of the tasks
  Duration after{};                  // pause after the end of the previous step
};

// Task has
//   std::uint8_t node() const;
//   std::optional<TaskStep> wanted();  called once for each step; nothing: the task has ended
//   void take(AbortCode, std::span<const std::byte> data);  the result of the step
//   static constexpr sdo::Priority kPriority; static constexpr unsigned kRepeats;
template <class Task>
class NodeTasks final : public sdo::TransferOwner {
 public:
  // timeout: for each answer. sdo must outlive this object.
  NodeTasks(sdo::Arbiter& sdo, Duration timeout) : sdo_(sdo), timeout_(timeout) {}
  ~NodeTasks() override { sdo_.disown(*this); }

  // Precondition: !busy(task->node()). client: see sdo::Request::client.
  void begin(std::unique_ptr<Task> task, Instant now, std::uint32_t client = 0) {
    LINEGATE_ASSERT(!busy(task->node()), "a node has one task at a time");
    std::unique_ptr<Running>& running = running_[task->node()];
    running = std::make_unique<Running>();
    running->task = std::move(task);
    running->client = client;
    ++count_;
    next(running, now);
  }
  bool busy(std::uint8_t node) const { return running_[node] != nullptr; }
  bool idle() const { return count_ == 0; }
  // nullptr if there is none.
  Task* find(std::uint8_t node) const {
    return running_[node] != nullptr ? running_[node]->task.get() : nullptr;
  }

  // Ends and returns the unfinished task; nullptr if there is none.
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
  // Not later than the earliest due time; may be earlier.
  Instant next_wake() const { return wake_; }

  // Removes and returns the task that ended first; nullptr if there is none.
  std::unique_ptr<Task> pop_ended() {
    if (ended_.empty()) {
      return nullptr;
    }
    std::unique_ptr<Task> out = std::move(ended_.front());
    ended_.pop_front();
    return out;
  }

 private:
  // Retry interval while the queue of the node is full of commands.
  static constexpr Duration kQueueFull = std::chrono::seconds(1);

  struct Running {
    std::unique_ptr<Task> task;
    TaskStep step;
    std::uint32_t client = 0;
    std::uint64_t transfer = 0;  // in progress; 0 = none
    Instant wake = kNever;       // start time of the step
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
                         .client = running.client,
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
