#include "stack/line/lss.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/deadline.h"
#include "stack/line/config.h"

namespace linegate::line {
namespace {

constexpr std::size_t kMostAsked = 32;
// After a person put devices into configuration, rounds leave them there.
constexpr Duration kHandsOff = std::chrono::minutes(1);
// A bus on which nothing can be sent has nobody to be given a node-ID.
constexpr Duration kStuck = std::chrono::seconds(1);
// The boot of the network waits no longer than that for node-IDs; what is left is done beside it.
constexpr Duration kLongestHold = std::chrono::seconds(30);
constexpr std::uint16_t kLssIdentity = 0x1018;

std::optional<std::uint32_t> described(const NodeConfig& node, std::uint8_t sub) {
  const od::VariableDescription* variable = node.device.find({kLssIdentity, sub});
  if (variable == nullptr || variable->value.size() != sizeof(std::uint32_t)) {
    return std::nullopt;
  }
  const auto value = load_le<std::uint32_t>(variable->value.data());
  return value == 0 ? std::nullopt : std::optional(value);
}

std::vector<lss::Candidate> candidates_of(const LineConfig& config) {
  std::vector<lss::Candidate> out;
  for (const NodeConfig& node : config.nodes) {
    lss::Candidate candidate{.node = node.id};
    for (const lss::Part part : {lss::kVendor, lss::kProduct, lss::kRevision}) {
      candidate.address[part] = described(node, static_cast<std::uint8_t>(part + 1));
    }
    if (!node.check.revision || node.check.revision_major_alone) {
      candidate.address[lss::kRevision] = std::nullopt;
    }
    candidate.address[lss::kSerial] = node.serial;  // a device file is of many
    if (!candidate.address[lss::kVendor] && node.device.vendor_number == 0) {
      candidate.address[lss::kVendor] = 0;  // of a house-made device, which has a product code
    }
    if (candidate.address[lss::kVendor] && candidate.address[lss::kProduct]) {
      out.push_back(candidate);
    }
  }
  return out;
}

lss::AssignerOptions options_of(const LssConfig& config) {
  return {
      .store = config.store,
      .bit_timing = config.bit_rate == 0 ? std::nullopt : lss::bit_timing_index(config.bit_rate)};
}

std::vector<std::byte> report_of(const std::vector<lss::Finding>& findings) {
  std::vector<std::byte> out(lss::kReplyHead);
  for (const lss::Finding& finding : findings) {
    out.push_back(static_cast<std::byte>(finding.verdict));
    out.push_back(std::byte{finding.node});
    out.push_back(std::byte{finding.error});
    out.push_back(std::byte{finding.specific});
    lss::put(finding.address.value_or(lss::Address{}), out);
  }
  return out;
}

}  // namespace

Lss::Lss(const LineConfig& config, const manager::Manager& manager, EventLog& events)
    : config_(config),
      manager_(manager),
      events_(events),
      master_(config.lss.timeout),
      assigner_(candidates_of(config), options_of(config.lss), *this) {
}

bool Lss::is_present(std::uint8_t node) const {
  return manager_.node(node).presence == Presence::present;
}

bool Lss::is_watched(std::uint8_t node) const {
  return is_present(node) && manager_.node(node).heartbeat_monitored;
}

void Lss::start(bool usable, Instant now) {
  usable_ = usable;
  started_ = true;
  if (!config_.lss.assign) {
    return;
  }
  next_round_ = now;
  if (usable) {
    holding_ = true;
    stuck_at_ = deadline(now, kStuck);
    hold_until_ = deadline(now, kLongestHold);
    pump(now);
  }
}

void Lss::stop() {
  started_ = holding_ = running_ = false;
  next_round_ = kNever;
  master_.cancel();
  assigner_.cancel();
  for (const Asked& asked : asked_) {
    replies_.push_back({.tag = asked.tag, .error = to_error(Refusal::cancelled), .data = {}});
  }
  asked_.clear();
}

bool Lss::execute(Command command, Instant now) {
  if (asked_.size() >= kMostAsked) {
    return false;
  }
  Asked asked{.tag = command.tag, .course = {}};
  const bool known = command.code < lss::kProcedures;
  asked.procedure = static_cast<lss::Procedure>(command.code);
  const bool assigns = known && asked.procedure == lss::Procedure::assign && command.data.empty();
  if (known && !assigns) {
    asked.course = lss::Course::make(asked.procedure, command.data);
  }
  if (!assigns && !asked.course) {
    replies_.push_back({.tag = command.tag, .error = to_error(Refusal::bad_request), .data = {}});
    return true;
  }
  if (command.timeout > Duration::zero()) {
    asked.deadline = deadline(now, command.timeout);
  }
  asked_.push_back(std::move(asked));
  // The search for devices that nobody knows has time; a person has not.
  if (!running_ && assigner_.active() && assigner_.nodes_done()) {
    master_.cancel();
    assigner_.end_early();
  }
  pump(now);
  return true;
}

std::optional<Reply> Lss::take_reply() {
  if (replies_.empty()) {
    return std::nullopt;
  }
  Reply out = std::move(replies_.front());
  replies_.pop_front();
  return out;
}

// --- one service after the other ----------------------------------------------------------------

void Lss::pump(Instant now) {
  for (;;) {
    if (const auto answer = master_.take()) {
      take_answer(*answer, now);
    }
    if (master_.busy()) {
      return;
    }
    if (course_runs()) {
      master_.start(asked_.front().course->request());
    } else if (assigner_.active()) {
      master_.start(assigner_.request());
    } else if (!begin_next(now)) {
      return;
    }
  }
}

// Commands first; a round when its time has come. False if there is nothing to be done.
bool Lss::begin_next(Instant now) {
  if (!asked_.empty()) {
    running_ = true;
    told_parts_ = 0;
    if (!asked_.front().course) {
      assigner_.begin();
    }
    return true;
  }
  if (!usable_ || now < next_round_ || now < hands_off_until_) {
    return false;
  }
  assigner_.begin();
  return true;
}

void Lss::take_answer(const lss::Answer& answer, Instant now) {
  if (course_runs()) {
    lss::Course& course = *asked_.front().course;
    course.answered(answer);
    tell_progress(course.parts(), now);
    if (course.over()) {
      note_configuration(answer, now);
      finish_command({}, course.reply());
    }
    return;
  }
  if (!assigner_.active()) {
    return;
  }
  assigner_.answered(answer);
  while (const auto finding = assigner_.take()) {
    tell(*finding, now);
  }
  if (assigner_.nodes_done()) {
    holding_ = false;
  }
  if (!assigner_.active()) {
    finish_round(now);
  }
}

// A command left devices in configuration, or took them all out of it.
void Lss::note_configuration(const lss::Answer& answer, Instant now) {
  using lss::Procedure;
  const Procedure procedure = asked_.front().procedure;
  const bool into = procedure == Procedure::switch_selective || procedure == Procedure::fastscan;
  if (procedure == Procedure::switch_global) {
    const bool configuration = asked_.front().course->request().configuration;
    hands_off_until_ = configuration ? deadline(now, kHandsOff) : now;
  } else if (into && answer.outcome == lss::Outcome::done) {
    hands_off_until_ = deadline(now, kHandsOff);
  }
}

void Lss::finish_command(Error error, std::vector<std::byte> data) {
  replies_.push_back({.tag = asked_.front().tag, .error = error, .data = std::move(data)});
  asked_.pop_front();
  running_ = false;
}

void Lss::finish_round(Instant now) {
  const Duration period = config_.lss.period;
  const bool again = started_ && config_.lss.assign && period > Duration::zero();
  next_round_ = again ? deadline(now, period) : kNever;
  hands_off_until_ = now;
  if (running_) {
    finish_command({}, report_of(assigner_.found()));
  }
}

void Lss::tell(const lss::Finding& finding, Instant now) {
  Event event{.time = now,
              .kind = EventKind::lss_result,
              .node = finding.node,
              .code = static_cast<std::uint32_t>(finding.verdict),
              .value = finding.error | static_cast<std::uint32_t>(finding.specific) << 8U};
  if (finding.address) {
    for (std::size_t i = 0; i < lss::kParts; ++i) {
      store_le(std::span(event.data).subspan(4 * i, 4), std::uint64_t{(*finding.address)[i]});
    }
    event.length = static_cast<std::uint8_t>(event.data.size());
  }
  events_.emit(event);
}

void Lss::tell_progress(unsigned parts, Instant now) {
  if (!asked_.front().course->is_fastscan() || parts <= told_parts_) {
    return;
  }
  told_parts_ = parts;
  Event event{.time = now,
              .kind = EventKind::command_progress,
              .length = 4,
              .code = static_cast<std::uint32_t>(CommandKind::lss),
              .value = parts};
  store_le(std::span(event.data).first(4), std::uint64_t{lss::kParts});
  events_.emit(event);
}

// --- frames and time ----------------------------------------------------------------------------

bool Lss::receive(const can::Frame& frame) {
  const bool good = master_.receive(frame);
  pump(frame.time);
  stuck_at_ = holding_ ? deadline(frame.time, kStuck) : kNever;
  return good;
}

void Lss::advance(bool usable, Instant now) {
  usable_ = usable;
  master_.advance(now);
  expire(now);
  release_if_stuck(now);
  pump(now);
}

void Lss::release_if_stuck(Instant now) {
  const bool stuck = now >= stuck_at_ && master_.wants_to_send();
  if (holding_ && (stuck || !usable_ || now >= hold_until_)) {
    holding_ = false;
  }
  if (!holding_) {
    stuck_at_ = kNever;
  } else if (now >= stuck_at_) {
    stuck_at_ = deadline(now, kStuck);
  }
}

void Lss::expire(Instant now) {
  for (std::size_t i = 0; i < asked_.size();) {
    if (asked_[i].deadline > now) {
      ++i;
      continue;
    }
    if (i == 0 && running_) {
      master_.cancel();
      assigner_.end_early();
      running_ = false;
    }
    replies_.push_back({.tag = asked_[i].tag, .error = to_error(Refusal::timed_out), .data = {}});
    asked_.erase(asked_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

Instant Lss::next_wake() const {
  Instant wake = earlier(master_.next_wake(), stuck_at_);
  wake = holding_ ? earlier(wake, hold_until_) : wake;
  if (usable_ && !master_.busy()) {
    wake = earlier(wake, std::max(next_round_, hands_off_until_));
  }
  for (const Asked& asked : asked_) {
    wake = earlier(wake, asked.deadline);
  }
  return wake;
}

bool Lss::next_frame(can::Frame& out, Instant now) {
  if (!master_.next_frame(out, now)) {
    return false;
  }
  sent_.add(out);
  stuck_at_ = holding_ ? deadline(now, kStuck) : kNever;
  pump(now);
  return true;
}

}  // namespace linegate::line
