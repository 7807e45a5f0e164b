#include "stack/manager/boot_slave.h"

#include <array>
#include <utility>

#include "stack/base/byte_order.h"

namespace linegate::manager {
namespace {

constexpr Duration kRetryDelay = std::chrono::seconds(1);  // between two questions for 1000h

constexpr std::uint16_t kDeviceType = 0x1000;
constexpr std::uint16_t kIdentity = 0x1018;

struct IdentityField {
  std::uint32_t NodePlan::*expected;
  std::uint32_t NodeState::*seen;
  char letter;
};
// By sub-index of 1018h, from 1.
constexpr std::array<IdentityField, 4> kIdentityFields{{
    {&NodePlan::vendor, &NodeState::vendor, 'D'},
    {&NodePlan::product, &NodeState::product, 'M'},
    {&NodePlan::revision, &NodeState::revision, 'N'},
    {&NodePlan::serial, &NodeState::serial, 'O'},
}};

std::uint32_t number(const std::vector<std::byte>& data) {
  return static_cast<std::uint32_t>(
      load_le(std::span(data).first(std::min<std::size_t>(data.size(), 4))));
}

}  // namespace

BootSlave::BootSlave(const NodePlan& plan, Duration sdo_timeout, sdo::Arbiter& sdo,
                     nmt::HeartbeatConsumer& heartbeats, EventLog& events, NodeState& node)
    : plan_(plan),
      sdo_timeout_(sdo_timeout),
      sdo_(sdo),
      heartbeats_(heartbeats),
      events_(events),
      node_(node) {
}

void BootSlave::begin(Instant now, bool expect_boot_up) {
  cancel();
  node_.boot = kBootUnfinished;
  b_told_ = false;
  give_up_ = now + plan_.boot_timeout;
  if (expect_boot_up) {
    set_step(Step::wait_boot_up, earlier(now + kResetWait, give_up_));
  } else {
    read_device_type(now);
  }
}

void BootSlave::cancel() {
  if (token_ != 0) {
    sdo_.cancel(std::exchange(token_, 0));
  }
  result_.reset();
  set_step(Step::idle, kNever);
}

void BootSlave::heartbeat(Instant now) {
  if (step_ == Step::wait_heartbeat) {
    finish(kBooted, 0, now);
  }
}

void BootSlave::completed(const sdo::Completion& completion, Instant now) {
  token_ = 0;
  switch (step_) {
    case Step::device_type:
      if (completion.abort != AbortCode::none) {
        no_answer(completion, now);
        return;
      }
      node_.presence = Presence::present;
      node_.device_type = number(completion.data);
      if (plan_.device_type != 0 && plan_.device_type != node_.device_type) {
        finish('C', node_.device_type, now);
        return;
      }
      identity_sub_ = 0;
      next_identity(now);
      return;
    case Step::identity:
      check_identity(completion, now);
      return;
    case Step::configure:
      if (completion.abort != AbortCode::none) {
        Event event{
            .time = now, .kind = EventKind::configuration_error, .node = plan_.id, .length = 3};
        event.code = static_cast<std::uint32_t>(completion.abort);
        store_le(event.data.data(), completion.address.index);
        event.data[2] = std::byte{completion.address.sub};
        events_.emit(event);
        finish('J', event.code, now);
        return;
      }
      ++write_;
      next_write(now);
      return;
    case Step::idle:
    case Step::wait_boot_up:
    case Step::wait_heartbeat:
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
    case Step::retry:
      read_device_type(now);
      return;
    case Step::wait_heartbeat:
      finish('K', 0, now);
      return;
    case Step::idle:
    case Step::device_type:
    case Step::identity:
    case Step::configure:
    case Step::done:
      wake_ = kNever;
      return;
  }
}

std::optional<char> BootSlave::take_result() {
  return std::exchange(result_, std::nullopt);
}

void BootSlave::read_device_type(Instant now) {
  set_step(Step::device_type, kNever);
  upload({kDeviceType, 0}, now);
}

void BootSlave::no_answer(const sdo::Completion& completion, Instant now) {
  if (now >= give_up_ && !b_told_) {
    b_told_ = true;
    node_.presence = Presence::missing;
    finish('B', static_cast<std::uint32_t>(completion.abort), now);
  }
  set_step(Step::retry, now + kRetryDelay);
}

// Asks only for what is expected; the serial number also to show it, where a device has one.
void BootSlave::next_identity(Instant now) {
  while (++identity_sub_ <= kIdentityFields.size()) {
    const bool wanted = plan_.*kIdentityFields[identity_sub_ - 1U].expected != 0;
    if (wanted || identity_sub_ == kIdentityFields.size()) {
      set_step(Step::identity, kNever);
      upload({kIdentity, identity_sub_}, now);
      return;
    }
  }
  write_ = 0;
  next_write(now);
}

void BootSlave::check_identity(const sdo::Completion& completion, Instant now) {
  const IdentityField& field = kIdentityFields[identity_sub_ - 1U];
  const std::uint32_t expected = plan_.*field.expected;
  if (completion.abort == AbortCode::none) {
    node_.*field.seen = number(completion.data);
  }
  if (expected != 0 && (completion.abort != AbortCode::none || node_.*field.seen != expected)) {
    const bool read = completion.abort == AbortCode::none;
    finish(field.letter, read ? node_.*field.seen : static_cast<std::uint32_t>(completion.abort),
           now);
    return;
  }
  next_identity(now);
}

void BootSlave::next_write(Instant now) {
  if (write_ >= plan_.writes.size()) {
    start_error_control(now);
    return;
  }
  set_step(Step::configure, kNever);
  const ObjectWrite& write = plan_.writes[write_];
  submit({.node = plan_.id, .address = write.address, .write = true, .data = write.data}, now);
}

void BootSlave::start_error_control(Instant now) {
  const Duration life_time = plan_.guard_time * plan_.life_time_factor;
  if (plan_.heartbeat_consumer == Duration::zero() && life_time > Duration::zero()) {
    heartbeats_.guard(plan_.id, plan_.guard_time, plan_.life_time_factor, now);
    node_.heartbeat_monitored = true;
    set_step(Step::wait_heartbeat, now + life_time);
    return;
  }
  if (plan_.heartbeat_consumer == Duration::zero()) {
    finish(kBooted, 0, now);
    return;
  }
  heartbeats_.monitor(plan_.id, plan_.heartbeat_consumer);
  node_.heartbeat_monitored = true;
  set_step(Step::wait_heartbeat, now + plan_.heartbeat_consumer);
}

void BootSlave::finish(char letter, std::uint32_t value, Instant now) {
  node_.boot = letter;
  result_ = letter;
  set_step(Step::done, kNever);
  Event event{.time = now, .kind = EventKind::boot_result, .node = plan_.id};
  event.code = static_cast<std::uint8_t>(letter);
  event.value = value;
  events_.emit(event);
}

void BootSlave::upload(od::Address address, Instant now) {
  submit({.node = plan_.id, .address = address, .write = false}, now);
}

void BootSlave::submit(sdo::Request request, Instant now) {
  token_ = kManagerToken | std::uint64_t{plan_.id} << 32U | ++sequence_;
  request.token = token_;
  request.timeout = sdo_timeout_;
  request.priority = sdo::Priority::boot;
  if (!sdo_.submit(std::move(request), now)) {
    // The queue of this node is full of commands: ask again when some of them are done.
    token_ = 0;
    set_step(Step::retry, now + kRetryDelay);
  }
}

void BootSlave::set_step(Step step, Instant wake) {
  step_ = step;
  wake_ = wake;
}

}  // namespace linegate::manager
