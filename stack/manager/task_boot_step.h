// SPDX-License-Identifier: Apache-2.0
// A step of the boot slave process (boot_step.h) that consists of a task (node_tasks.h).
#pragma once

#include <optional>
#include <utility>

#include "stack/manager/boot_step.h"
#include "stack/manager/node_tasks.h"

namespace linegate::manager {

template <class Task>
class TaskBootStep : public BootStep {
 public:
  void begin(StepContext& context, Instant now) override {
    context_ = &context;
    run(first(context), now);
  }
  void completed(const sdo::Completion& completion, Instant now) override {
    if (task_) {
      task_->take(completion.abort, completion.data);
      next(now);
    }
  }
  void resumed(Instant now) override { run(again(*context_), now); }
  void advance(Instant now) override {
    if (task_ && wake_ <= now) {
      wake_ = kNever;
      submit(now);
    }
  }
  Instant next_wake() const override { return wake_; }
  void cancel() override {
    task_.reset();
    end_.reset();
    wake_ = kNever;
  }
  std::optional<StepEnd> pop_end() override { return std::exchange(end_, std::nullopt); }

 protected:
  // nullptr if no task runs.
  Task* task() { return task_ ? &*task_ : nullptr; }

 private:
  // The first task, and the task after a requested reset.
  virtual Task first(const StepContext& context) = 0;
  virtual Task again(const StepContext& context) = 0;
  // Converts the result of the task into the result of the step.
  virtual StepEnd judge(const Task& task, Instant now) = 0;

  void run(Task task, Instant now) {
    end_.reset();
    wake_ = kNever;
    task_.emplace(std::move(task));
    next(now);
  }

  void next(Instant now) {
    auto step = task_->wanted();
    if (!step) {
      end_ = judge(*task_, now);
      task_.reset();
      return;
    }
    step_ = *std::move(step);
    if (step_.after > Duration::zero()) {
      wake_ = now + step_.after;
    } else {
      submit(now);
    }
  }

  void submit(Instant now) {
    context_->submit(
        {.address = step_.address,
         .write = step_.write,
         .data = step_.data,
         .source = step_.source,
         .timeout = step_.timeout > Duration::zero() ? step_.timeout : context_->sdo_timeout()},
        now);
  }

  StepContext* context_ = nullptr;
  std::optional<Task> task_;
  TaskStep step_;
  Instant wake_ = kNever;
  std::optional<StepEnd> end_;
};

}  // namespace linegate::manager
