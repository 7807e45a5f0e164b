// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/boot_slave.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/manager/boot_event.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

constexpr Duration kRetryDelay = std::chrono::seconds(1);  // between two uploads of 1000h
// This number of consecutive equal communication errors at the same object counts as a refusal:
// devices without segmented transfer answer 0504 0001h to every longer value. A device that is
// still starting may answer so as well, so the boot time-out must also be over.
constexpr std::uint32_t kRefusals = 3;
// For the answer to one node guarding request to a node that is to be kept alive.
constexpr Duration kGuardWait = std::chrono::milliseconds(100);

// A node that shows Operational or Stopped this long after its NMT reset did not receive the reset.
// Frames sent before the reset may arrive until then.
constexpr Duration kResetGrace = std::chrono::milliseconds(100);
constexpr unsigned kMaxResetRepeats = 3;
// Pause after the second restart of a node during its configuration; doubled with each further
// restart.
constexpr Duration kFirstPause = std::chrono::seconds(1);
constexpr Duration kLongestPause = std::chrono::seconds(30);

constexpr od::Address kDeviceType{od::objects::kDeviceType, 0};
constexpr std::uint32_t kMajorRevision = 0xFFFF'0000;  // CiA 301 7.5.2.21

struct IdentityField {
  std::uint16_t expected;
  std::uint32_t NodeState::*seen;
  char letter;
};
// By sub-index of 1018h, from 1.
constexpr std::array<IdentityField, 4> kIdentityFields{{
    {od::objects::kExpectedVendor, &NodeState::vendor, 'D'},
    {od::objects::kExpectedProduct, &NodeState::product, 'M'},
    {od::objects::kExpectedRevision, &NodeState::revision, 'N'},
    {od::objects::kExpectedSerial, &NodeState::serial, 'O'},
}};

std::uint32_t number(const std::vector<std::byte>& data) {
  return static_cast<std::uint32_t>(
      load_le(std::span(data).first(std::min<std::size_t>(data.size(), 4))));
}

// Treats an answer that does not match the request, or a malformed abort, as a communication error:
// neither is a refusal.
sdo::Completion understood(sdo::Completion completion) {
  if (completion.abort != AbortCode::none && !completion.refused &&
      !is_communication_error(completion.abort)) {
    completion.abort = AbortCode::command_specifier;
  }
  return completion;
}

BootFinding differs(od::Address object, std::uint32_t expected, std::uint32_t found) {
  return {.kind = BootFinding::Kind::value,
          .object = object,
          .abort = AbortCode::none,
          .expected = expected,
          .found = found};
}

BootFinding aborted(const sdo::Completion& completion) {
  return {
      .kind = BootFinding::Kind::abort, .object = completion.address, .abort = completion.abort};
}

}  // namespace

BootSlave::BootSlave(const NodePlan& plan, const BootServices& services, NodeState& node)
    : plan_(plan), services_(services), node_(node) {
}

void BootSlave::begin(Reason reason, Instant now, nmt::Command command) {
  clear();
  reset_ = {.waits_for_boot_up = reason == Reason::reset, .command = command, .sent = now};
  node_.boot = kBootUnfinished;
  node_.finding = {};
  assignment_ = services_.list.assignment(plan_.id);
  booted_up_ = reason != Reason::present;
  was_operational_ = false;
  restarts_ = 0;
  if (reason != Reason::present || pdos_ != Pdos::compared) {
    forget_pdos();
  }
  give_up_ = now + plan_.boot_timeout;
  if (!has(assignment::kListed)) {
    finish('A', {}, now);
  } else if (reason == Reason::reset) {
    state_unknown();
    set_step(Step::wait_boot_up, earlier(now + plan_.reset_time, give_up_));
  } else if (!has(assignment::kBoot)) {
    start_error_control(now);
  } else {
    read_device_type(now);
  }
}

void BootSlave::abandon_step() {
  if (transfer_ != 0) {
    services_.sdo.cancel(services_.owner, plan_.id, std::exchange(transfer_, 0));
  }
  if (step_ == Step::program || step_ == Step::configuration) {
    running().cancel();
  }
}

void BootSlave::cancel() {
  clear();
  if (pdos_ == Pdos::compared) {
    pdos_ = Pdos::unmanaged;
  }
  client_ = 0;
}

void BootSlave::clear() {
  abandon_step();
  reset_ = {};
  result_.reset();
  reported_ = false;
  set_step(Step::idle, kNever);
}

void BootSlave::boot_up(Instant now) {
  if (step_ == Step::idle || step_ == Step::done) {
    client_ = 0;
  }
  reset_.waits_for_boot_up = false;
  if (step_ == Step::wait_reset) {
    after_reset(now);
  } else if (step_ == Step::program) {
    return;  // a device restarts when its program is stopped or started
  } else if (step_ == Step::configuration || step_ == Step::error_control) {
    restarted(now);
  } else if (step_ == Step::done && node_.boot == kConfigurationFailed &&
             now - ended_ <= kBootUpDelay) {
    clear();
    restarted(now);
  } else if (restarts_ == 0 || step_ == Step::done || step_ == Step::idle) {
    begin(Reason::boots_up, now);
  } else if (step_ != Step::retry) {
    abandon_step();
    read_device_type(now);
  }
}

void BootSlave::restarted(Instant now) {
  abandon_step();
  services_.heartbeats.stop(plan_.id);
  node_.heartbeat_monitored = false;
  booted_up_ = true;
  was_operational_ = false;
  ++restarts_;
  if (!reported_) {
    node_.boot = kBootUnfinished;
    node_.finding = {};
  }
  if (restarts_ == 1) {
    read_device_type(now);
    return;
  }
  const Duration pause = std::min(kFirstPause * (1 << std::min(restarts_ - 2, 8U)), kLongestPause);
  set_step(Step::retry, now + pause);
  const BootFinding finding{.kind = BootFinding::Kind::last, .object = last_written_};
  if (now + pause >= give_up_ &&
      !(reported_ && node_.boot == kRestarts && node_.finding == finding)) {
    reported_ = true;
    report(kRestarts, finding, now);
  }
}

void BootSlave::heartbeat(nmt::State state, Instant now) {
  if (missed_reset(state, now)) {
    repeat_reset(now);
  } else if (step_ == Step::error_control) {
    finish(was_operational_ ? kWasOperational : kBooted, {}, now);
  } else if (step_ == Step::keep_alive) {
    if (state == nmt::State::operational) {
      was_operational_ = true;
      configure(now);
    } else {
      reset(now);
    }
  }
}

bool BootSlave::heartbeat_lost(Instant now) {
  if (step_ != Step::error_control || wake_ == kNever) {
    return false;
  }
  no_error_control(now);
  return true;
}

void BootSlave::completed(const sdo::Completion& answer, Instant now) {
  const sdo::Completion completion = understood(answer);
  said_ = answer.refused;
  transfer_ = 0;
  switch (step_) {
    case Step::device_type:
      check_device_type(completion, now);
      return;
    case Step::identity:
      check_identity(completion, now);
      return;
    case Step::program:
    case Step::configuration:
      running().completed(completion, now);
      process_step_end(now);
      return;
    case Step::idle:
    case Step::wait_boot_up:
    case Step::keep_alive:
    case Step::wait_reset:
    case Step::error_control:
    case Step::retry:
    case Step::done:
      return;
  }
}

void BootSlave::advance(Instant now) {
  if (now < wake_) {
    return;
  }
  switch (step_) {
    case Step::wait_boot_up:
      if (!has(assignment::kBoot)) {
        start_error_control(now);
        return;
      }
      read_device_type(now);
      return;
    case Step::retry:
      read_device_type(now);
      return;
    case Step::keep_alive:
      search(plan_.heartbeat_consumer > Duration::zero() ? 'E' : 'F', {}, now);
      return;
    case Step::wait_reset:
      after_reset(now);
      return;
    case Step::error_control:
      no_error_control(now);
      return;
    case Step::program:
    case Step::configuration:
      running().advance(now);
      process_step_end(now);
      return;
    case Step::idle:
    case Step::device_type:
    case Step::identity:
    case Step::done:
      wake_ = kNever;
      return;
  }
}

std::optional<char> BootSlave::pop_result() {
  return std::exchange(result_, std::nullopt);
}

// --- identity -----------------------------------------------------------------------------------

void BootSlave::read_device_type(Instant now) {
  set_step(Step::device_type, kNever);
  if (reset_.waits_for_boot_up && services_.list.guard_time(plan_.id) > Duration::zero()) {
    // A guarded node sends no heartbeat that would show whether it was reset
    services_.heartbeats.ask(plan_.id);
  }
  upload(kDeviceType, now);
}

void BootSlave::check_device_type(const sdo::Completion& completion, Instant now) {
  if (completion.abort != AbortCode::none) {
    if (said_) {
      node_.presence = Presence::present;
    } else if (completion.abort == AbortCode::timeout) {
      missing();
    }
    if (now >= give_up_) {
      search('B', aborted(completion), now);
    } else {
      set_step(Step::retry, now + kRetryDelay);
    }
    return;
  }
  node_.presence = Presence::present;
  node_.device_type = number(completion.data);
  const std::uint32_t expected =
      services_.list.expected(od::objects::kExpectedDeviceType, plan_.id);
  if (expected != 0 && expected != node_.device_type) {
    finish('C', differs(kDeviceType, expected, node_.device_type), now);
    return;
  }
  identity_sub_ = 0;
  next_identity(now);
}

// Reads only fields with an expected value, and always the serial number, which is published.
void BootSlave::next_identity(Instant now) {
  while (++identity_sub_ <= kIdentityFields.size()) {
    const IdentityField& field = kIdentityFields[identity_sub_ - 1U];
    const bool wanted = services_.list.expected(field.expected, plan_.id) != 0;
    if (wanted || identity_sub_ == kIdentityFields.size()) {
      set_step(Step::identity, kNever);
      upload({od::objects::kIdentity, identity_sub_}, now);
      return;
    }
  }
  check_keep_alive(now);
}

void BootSlave::check_identity(const sdo::Completion& completion, Instant now) {
  const IdentityField& field = kIdentityFields[identity_sub_ - 1U];
  const std::uint32_t expected = services_.list.expected(field.expected, plan_.id);
  if (completion.abort == AbortCode::none) {
    node_.*field.seen = number(completion.data);
    const bool major_alone =
        plan_.revision_major_alone && field.expected == od::objects::kExpectedRevision;
    const std::uint32_t compared = major_alone ? kMajorRevision : ~0U;
    if (expected != 0 && ((node_.*field.seen ^ expected) & compared) != 0) {
      finish(field.letter, differs(completion.address, expected, node_.*field.seen), now);
      return;
    }
  } else if (expected != 0) {
    fail(field.letter, aborted(completion), now);
    return;
  }
  next_identity(now);
}

// --- keep alive ---------------------------------------------------------------------------------

// A node that has just booted up cannot be Operational, whatever its assignment.
void BootSlave::check_keep_alive(Instant now) {
  if (!has(assignment::kKeepAlive) || booted_up_) {
    check_program(now);
  } else if (plan_.heartbeat_consumer > Duration::zero()) {
    set_step(Step::keep_alive, now + plan_.heartbeat_consumer);
  } else {
    set_step(Step::keep_alive, now + kGuardWait);
    services_.heartbeats.ask(plan_.id);
  }
}

void BootSlave::reset(Instant now) {
  LINEGATE_ASSERT(step_ != Step::wait_reset, "the step after the reset is known");
  // Restored values include those of the application, so reset node is needed.
  reset_and_continue(
      step_,
      step_ == Step::configuration ? nmt::Command::reset_node : nmt::Command::reset_communication,
      now);
}

// by: the step that after_reset() takes for the cause.
void BootSlave::reset_and_continue(Step by, nmt::Command command, Instant now) {
  reset_by_ = by;
  reset_.repeats = 0;
  send_reset(command, now);
  set_step(Step::wait_reset, now + plan_.reset_time);
}

void BootSlave::send_reset(nmt::Command command, Instant now) {
  reset_.waits_for_boot_up = true;
  reset_.command = command;
  reset_.sent = now;
  services_.host.send_nmt(command, plan_.id, now);
  services_.sdo.charge(client_, 1);
  forget_pdos();
  state_unknown();
}

void BootSlave::forget_pdos() {
  const bool boots = services_.list.has(plan_.id, assignment::kListed | assignment::kBoot);
  pdos_ = boots ? Pdos::unknown : Pdos::unmanaged;
}

// The node was reset or does not answer: the state it showed before is no longer valid.
void BootSlave::state_unknown() {
  node_.state = nmt::State::unknown;
  services_.host.node_data_invalid(plan_.id);
}

// Called for each attempt to boot a silent node; only the first one changes the published state.
void BootSlave::missing() {
  const bool is_news = node_.presence != Presence::missing || node_.state != nmt::State::unknown;
  node_.presence = Presence::missing;
  if (is_news) {
    state_unknown();
  }
}

// Nodes without a boot slave process are excluded, because another application may start them.
bool BootSlave::missed_reset(nmt::State state, Instant now) const {
  const bool was_not_reset = state == nmt::State::operational || state == nmt::State::stopped;
  if (!was_not_reset || !reset_.waits_for_boot_up || !has(assignment::kBoot) ||
      reset_.repeats >= kMaxResetRepeats || now - reset_.sent < kResetGrace) {
    return false;
  }
  switch (step_) {
    case Step::wait_boot_up:
    case Step::device_type:
    case Step::identity:
    case Step::keep_alive:
    case Step::wait_reset:
    case Step::configuration:
    case Step::error_control:
    case Step::retry:
      return true;
    case Step::idle:
    case Step::program:  // the program step has exclusive access to the node
    case Step::done:
      return false;
  }
  return false;
}

// The boot process restarts from its beginning, within the running boot time-out.
void BootSlave::repeat_reset(Instant now) {
  ++reset_.repeats;
  send_reset(reset_.command, now);
  if (step_ == Step::wait_reset) {
    set_step(Step::wait_reset, now + plan_.reset_time);
    return;
  }
  abandon_step();
  services_.heartbeats.stop(plan_.id);
  node_.heartbeat_monitored = false;
  set_step(Step::wait_boot_up, now + plan_.reset_time);
}

void BootSlave::after_reset(Instant now) {
  booted_up_ = true;
  if (reset_by_ == Step::keep_alive) {
    check_program(now);
    return;
  }
  set_step(reset_by_, kNever);
  running().resumed(now);
  process_step_end(now);
}

// --- program and configuration ------------------------------------------------------------------

void BootSlave::check_program(Instant now) {
  if (!has(assignment::kVerifySoftware)) {
    configure(now);
  } else if (program_ == nullptr) {
    finish('G', {}, now);
  } else {
    run(*program_, Step::program, now);
  }
}

void BootSlave::configure(Instant now) {
  if (configuration_ == nullptr) {
    start_error_control(now);
  } else {
    run(*configuration_, Step::configuration, now);
  }
}

void BootSlave::run(BootStep& step, Step which, Instant now) {
  set_step(which, kNever);
  step.begin(*this, now);
  process_step_end(now);
}

BootStep& BootSlave::running() {
  LINEGATE_ASSERT(step_ == Step::program || step_ == Step::configuration, "such a step runs");
  return step_ == Step::program ? *program_ : *configuration_;
}

// Processes the result of the running step.
void BootSlave::process_step_end(Instant now) {
  if (step_ != Step::program && step_ != Step::configuration) {
    return;  // the queue of the node is full, see submit()
  }
  const auto end = running().pop_end();
  if (!end) {
    wake_ = running().next_wake();
    return;
  }
  switch (end->kind) {
    case StepEnd::Kind::done:
      if (step_ == Step::program) {
        configure(now);
      } else {
        start_error_control(now);
      }
      return;
    case StepEnd::Kind::failed:
      if (end->again && !is_communication_error(end->finding.abort)) {
        search(end->letter, end->finding, now);
      } else {
        fail(end->letter, end->finding, now);
      }
      return;
    case StepEnd::Kind::reset:
      reset(now);
      return;
    case StepEnd::Kind::unlike:
      was_operational_ = false;
      reset_and_continue(Step::keep_alive, nmt::Command::reset_communication, now);
      return;
    case StepEnd::Kind::anew:
      booted_up_ = true;  // a new program runs
      read_device_type(now);
      return;
  }
}

// --- error control ------------------------------------------------------------------------------

void BootSlave::start_error_control(Instant now) {
  const Duration guard_time = services_.list.guard_time(plan_.id);
  const std::uint8_t factor = services_.list.life_time_factor(plan_.id);
  if (plan_.heartbeat_consumer > Duration::zero()) {
    services_.heartbeats.monitor(plan_.id, plan_.heartbeat_consumer);
    started_error_control_ = true;
    node_.heartbeat_monitored = true;
    set_step(Step::error_control, now + plan_.heartbeat_consumer);
  } else if (guard_time * factor > Duration::zero()) {
    services_.heartbeats.guard(plan_.id, guard_time, factor, now);
    started_error_control_ = true;
    node_.heartbeat_monitored = true;
    set_step(Step::error_control, now + guard_time * factor);
  } else {
    finish(was_operational_ ? kWasOperational : kBooted, {}, now);
  }
}

// The node is configured, so a later heartbeat still completes its boot process.
void BootSlave::no_error_control(Instant now) {
  wake_ = kNever;
  missing();
  report(kNoErrorControl, {}, now);
}

// --- results ------------------------------------------------------------------------------------

// Ends the process with the letter; after a communication error it tries again first, see
// kRefusals.
void BootSlave::fail(char letter, BootFinding finding, Instant now) {
  if (!is_communication_error(finding.abort)) {
    finish(letter, finding, now);
    return;
  }
  const bool again = reported_ && said_ && node_.boot == letter && node_.finding == finding;
  refusals_ = again ? refusals_ + 1 : std::uint32_t{said_};
  if (refusals_ < kRefusals || now < give_up_) {
    search(letter, finding, now);
  } else {
    finding.expected = refusals_;
    finish(letter, finding, now);
  }
}

void BootSlave::finish(char letter, const BootFinding& finding, Instant now) {
  reported_ = false;
  ended_ = now;
  set_step(Step::done, kNever);
  report(letter, finding, now);
}

// The node does not answer, or its answer cannot be used: keeps trying every second. An unchanged
// result is reported once.
void BootSlave::search(char letter, const BootFinding& finding, Instant now) {
  if (finding.abort == AbortCode::timeout && !said_) {
    missing();
  }
  set_step(Step::retry, now + kRetryDelay);
  if (!reported_ || node_.boot != letter || node_.finding != finding) {
    reported_ = true;
    report(letter, finding, now);
  }
}

void BootSlave::report(char letter, const BootFinding& finding, Instant now) {
  node_.boot = letter;
  node_.finding = finding;
  if (is_booted(letter) || letter == kNoErrorControl) {
    pdos_ = Pdos::compared;
  } else {
    forget_pdos();
  }
  result_ = letter;
  services_.events.emit(boot_result(plan_.id, letter, finding, now));
}

void BootSlave::upload(od::Address address, Instant now) {
  submit({.address = address, .write = false, .timeout = sdo_timeout()}, now);
}

Duration BootSlave::sdo_timeout() const {
  return plan_.sdo_timeout > Duration::zero() ? plan_.sdo_timeout : services_.sdo_timeout;
}

void BootSlave::submit(sdo::Request request, Instant now) {
  if (request.write && step_ == Step::configuration) {
    last_written_ = request.address;
  }
  transfer_ = ++sequence_;
  request.owner = &services_.owner;
  request.number = transfer_;
  request.node = plan_.id;
  request.priority = sdo::Priority::boot;
  request.client = client_;
  said_ = false;
  if (!services_.sdo.submit(std::move(request), now)) {
    // The queue of this node is full of commands: retry when some of them are done.
    transfer_ = 0;
    if (step_ == Step::program || step_ == Step::configuration) {
      running().cancel();
    }
    set_step(Step::retry, now + kRetryDelay);
  }
}

bool BootSlave::may_follow(Step before, Step step) {
  const bool reads = before == Step::device_type || before == Step::identity;
  const bool runs = before == Step::program || before == Step::configuration;
  switch (step) {
    case Step::idle:
      return true;
    case Step::wait_boot_up:
      return before != Step::wait_reset && before != Step::program && before != Step::done;
    case Step::device_type:
      return before != Step::done;
    case Step::identity:
      return reads;
    case Step::keep_alive:
      return reads;
    case Step::wait_reset:
      return before == Step::keep_alive || before == Step::wait_reset || runs;
    case Step::program:
      return reads || before == Step::wait_reset;
    case Step::configuration:
      return reads || before == Step::program || before == Step::wait_reset ||
             before == Step::keep_alive;
    case Step::error_control:
    case Step::done:
      return before != Step::retry && before != Step::done;
    case Step::retry:
      return reads || runs || before == Step::keep_alive || before == Step::error_control ||
             before == Step::idle;
  }
  return false;
}

void BootSlave::set_step(Step step, Instant wake) {
  LINEGATE_ASSERT(may_follow(step_, step), "the boot process takes its steps in order");
  step_ = step;
  wake_ = wake;
}

}  // namespace linegate::manager
