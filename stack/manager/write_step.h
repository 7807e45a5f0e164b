// The configuration step in its simplest form: the writes of the plan, one after the other.
#pragma once

#include <cstddef>

#include "stack/base/event_log.h"
#include "stack/manager/boot_step.h"

namespace linegate::manager {

// Fails with J at the first write that is refused or not answered, and tells a refusal as
// EventKind::configuration_error.
class WriteStep final : public BootStep {
 public:
  explicit WriteStep(EventLog& events) : events_(events) {}

  void begin(StepContext& context, Instant now) override;
  void completed(const sdo::Completion& completion, Instant now) override;
  void resumed(Instant /*now*/) override {}
  void advance(Instant /*now*/) override {}
  Instant next_wake() const override { return kNever; }
  void cancel() override { end_.reset(); }
  std::optional<StepEnd> take_end() override;

 private:
  void next(Instant now);

  EventLog& events_;
  StepContext* context_ = nullptr;
  std::size_t write_ = 0;
  std::optional<StepEnd> end_;
};

}  // namespace linegate::manager
