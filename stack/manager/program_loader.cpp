// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/program_loader.h"

#include <utility>

#include "stack/can/cob_id.h"
#include "stack/manager/network_list.h"
#include "stack/manager/task_boot_step.h"

namespace linegate::manager {
namespace {

constexpr Duration kReportPeriod = std::chrono::seconds(1);

char letter_of(ProgramRun::Result result) {
  switch (result) {
    case ProgramRun::Result::unverifiable:
      return 'G';
    case ProgramRun::Result::forbidden:
      return 'H';
    case ProgramRun::Result::failed:
      return 'I';
    case ProgramRun::Result::loaded:
    case ProgramRun::Result::unchanged:
      break;
  }
  return kBooted;
}

}  // namespace

class ProgramLoader::Step final : public TaskBootStep<ProgramRun> {
 public:
  Step(ProgramLoader& owner, std::uint8_t node) : owner_(owner), node_(node) {}
  ~Step() override { owner_.runs(node_, nullptr, {}); }

  void completed(const sdo::Completion& completion, Instant now) override {
    TaskBootStep::completed(completion, now);
    owner_.runs(node_, task(), now);
  }
  void cancel() override {
    TaskBootStep::cancel();
    owner_.runs(node_, nullptr, {});
  }

 private:
  ProgramRun first(const StepContext& /*context*/) override {
    return ProgramRun(owner_.order(node_));
  }
  ProgramRun again(const StepContext& context) override { return first(context); }
  StepEnd judge(const ProgramRun& run, Instant /*now*/) override {
    const char letter = letter_of(run.result());
    if (letter != kBooted) {
      return {.kind = StepEnd::Kind::failed, .letter = letter, .finding = run.finding()};
    }
    return {.kind = run.result() == ProgramRun::Result::loaded ? StepEnd::Kind::anew
                                                               : StepEnd::Kind::done};
  }

  ProgramLoader& owner_;
  std::uint8_t node_;
};

ProgramLoader::ProgramLoader(od::Dictionary& dictionary, std::span<const NodePlan> plans,
                             sdo::Arbiter& sdo, EventLog& events, Duration sdo_timeout,
                             line::CommandKind command)
    : dictionary_(dictionary),
      events_(events),
      command_(command),
      objects_(dictionary, plans),
      tasks_(sdo, sdo_timeout) {
}

std::unique_ptr<BootStep> ProgramLoader::make_step(std::uint8_t node) {
  return std::make_unique<Step>(*this, node);
}

// A node that is to be kept alive is not stopped in order to update its program.
ProgramOrder ProgramLoader::order(std::uint8_t node) const {
  const NetworkList list(dictionary_);
  return {.node = node,
          .check = true,
          .expected = objects_.expected(node),
          .update = list.has(node, assignment::kUpdateSoftware) &&
                    !list.has(node, assignment::kKeepAlive),
          .program = objects_.program(node)};
}

void ProgramLoader::load(ProgramOrder order, Instant now, std::uint32_t client) {
  tasks_.begin(std::make_unique<ProgramRun>(std::move(order)), now, client);
  report_at_ = earlier(report_at_, now + kReportPeriod);
}

void ProgramLoader::boot_up(std::uint8_t node) {
  if (ProgramRun* const run = running(node)) {
    run->boot_up();
  }
}

void ProgramLoader::runs(std::uint8_t node, ProgramRun* run, Instant now) {
  if (run != nullptr && steps_[node] == nullptr) {
    report_at_ = earlier(report_at_, now + kReportPeriod);
  }
  steps_[node] = run;
}

ProgramRun* ProgramLoader::running(std::uint8_t node) const {
  return steps_[node] != nullptr ? steps_[node] : tasks_.find(node);
}

void ProgramLoader::advance(Instant now) {
  tasks_.advance(now);
  if (now < report_at_) {
    return;
  }
  report_at_ = kNever;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const ProgramRun* run = running(node);
    if (run == nullptr) {
      continue;
    }
    report_at_ = now + kReportPeriod;
    events_.emit(
        {.time = now,
         .node = node,
         .data = event::CommandProgress{.command = command_,
                                        .done = static_cast<std::uint32_t>(run->done()),
                                        .total = static_cast<std::uint32_t>(run->total())}});
  }
}

}  // namespace linegate::manager
