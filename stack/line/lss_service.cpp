// SPDX-License-Identifier: Apache-2.0
#include "stack/line/lss_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/time.h"
#include "stack/line/config.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

constexpr std::size_t kMostAsked = 32;
constexpr std::size_t kMostOfOneClient = 16;
// How long rounds leave devices in configuration after a command put them there.
constexpr Duration kHandsOff = std::chrono::minutes(1);
// If no frame can be sent for this long, no device on the bus can be assigned a node-ID.
constexpr Duration kStuck = std::chrono::seconds(1);
// The longest time that the boot of the network waits for node-IDs; the remaining ones are assigned
// while it boots.
constexpr Duration kLongestHold = std::chrono::seconds(30);

std::optional<std::uint32_t> described(const NodeConfig& node, std::uint8_t sub) {
  const od::VariableDescription* variable = node.device.find({od::objects::kIdentity, sub});
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
    candidate.address[lss::kSerial] = node.serial;  // a device file describes many devices
    if (!candidate.address[lss::kVendor] && node.device.vendor_number == 0) {
      candidate.address[lss::kVendor] = 0;  // a device without vendor-ID, which has a product code
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

LssService::LssService(ServiceHost& host, const LineConfig& config, manager::Manager& manager,
                       const NodeIdCheck::Services& services,
                       std::span<const pdo::LinkedPdo> inputs, EventLog& events)
    : Service(host),
      config_(config),
      manager_(manager),
      sdo_(services.sdo),
      nmt_(services.host),
      events_(events),
      check_(config, services, *this, inputs),
      master_(config.lss.timeout),
      assigner_(candidates_of(config), options_of(config.lss), *this) {
}

bool LssService::is_present(std::uint8_t node) const {
  return manager_.node(node).presence == Presence::present ||
         std::ranges::find(given_, node, &Given::node) != given_.end();
}

bool LssService::is_watched(std::uint8_t node) const {
  return manager_.node(node).presence == Presence::present &&
         manager_.node(node).heartbeat_monitored;
}

std::span<const CommandKind> LssService::commands() const {
  static constexpr std::array kCommands{CommandKind::lss};
  return kCommands;
}

void LssService::start(Instant now) {
  usable_ = host().usable();
  started_ = true;
  network_started_ = false;
  if (config_.lss.assign) {
    next_round_ = now;
  }
  if (config_.lss.assign && usable_) {
    holding_ = true;
    stuck_at_ = deadline(now, kStuck);
    hold_until_ = deadline(now, kLongestHold);
    pump(now);
  }
  start_network(now);
}

// Starts the network once, as soon as nothing holds the start.
void LssService::start_network(Instant now) {
  if (started_ && !holding_ && !std::exchange(network_started_, true)) {
    manager_.start(now);
  }
}

void LssService::end(Refusal why, Instant /*now*/) {
  started_ = holding_ = running_ = interrupted_ = false;
  number_ = 0;
  next_round_ = kNever;
  master_.cancel();
  assigner_.cancel();
  check_.end();
  given_.clear();
  for (const Asked& asked : asked_) {
    host().reply(asked.tag, to_error(why), {});
  }
  asked_.clear();
}

void LssService::execute(Command command, Instant now) {
  Refusal why = Refusal::none;
  if (!host().manages()) {
    why = Refusal::wrong_role;
  } else if (config_.canopen_fd) {
    why = Refusal::wrong_interface;  // its frames are not defined
  } else if (!host().usable()) {
    why = Refusal::line_down;
  } else {
    why = queue(command, now);
  }
  if (why != Refusal::none) {
    host().refuse(command, why, now);
  }
  start_network(now);
}

Refusal LssService::queue(const Command& command, Instant now) {
  const auto of_client = std::ranges::count(asked_, command.client, &Asked::client);
  if (asked_.size() >= kMostAsked ||
      (command.client != 0 && static_cast<std::size_t>(of_client) >= kMostOfOneClient)) {
    return Refusal::busy;
  }
  Asked asked{.tag = command.tag, .client = command.client, .course = {}};
  const auto& request = std::get<LssRequest>(command.request);
  asked.procedure = request.procedure;
  const bool assigns = request.procedure == lss::Procedure::assign && request.arguments.empty();
  if (!assigns) {
    asked.course = lss::Course::make(request.procedure, request.arguments);
  }
  const bool bad = !assigns && !asked.course;
  const bool checks = assigns || asked.procedure == lss::Procedure::configure_node_id;
  if (bad || (checks && !check_.may_ask())) {
    const Refusal why = bad ? Refusal::bad_request : Refusal::wrong_state;
    host().reply(command.tag, to_error(why), {});
    return Refusal::none;
  }
  if (command.timeout > Duration::zero()) {
    asked.deadline = deadline(now, command.timeout);
  }
  asked_.push_back(std::move(asked));
  // A command takes precedence over the search for unknown devices.
  if (!running_ && assigner_.active() && assigner_.nodes_done()) {
    master_.cancel();
    assigner_.end_early();
  }
  pump(now);
  return Refusal::none;
}

// --- one service after the other ----------------------------------------------------------------

void LssService::pump(Instant now) {
  for (;;) {
    if (const auto answer = master_.take()) {
      receive_answer(*answer, now);
    }
    if (master_.busy()) {
      return;
    }
    if (node_to_check()) {
      if (!check_node_id(now)) {
        return;
      }
    } else if (course_runs()) {
      begin_service(asked_.front().course->request(), now);
    } else if (assigner_.active()) {
      begin_service(assigner_.request(), now);
    } else if (!begin_next(now)) {
      return;
    }
  }
}

void LssService::begin_service(const lss::Request& request, Instant now) {
  master_.start(request);
  look_again(now);
  stuck_at_ = holding_ ? deadline(now, kStuck) : kNever;
  unsent_at_ = course_runs() ? deadline(now, kSendTime) : kNever;
}

// Begins a queued command, else a round that is due. Returns false if there is nothing to do.
bool LssService::begin_next(Instant now) {
  check_.end();
  if (!asked_.empty()) {
    running_ = true;
    reported_parts_ = 0;
    if (!asked_.front().course) {
      deselect();
      assigner_.begin();
    }
    return true;
  }
  if (!usable_ || now < next_round_ || now < hands_off_until_ || !check_.may_ask()) {
    return false;
  }
  deselect();
  assigner_.begin();
  return true;
}

std::optional<std::uint8_t> LssService::node_to_check() const {
  return course_runs() ? asked_.front().course->node_to_check() : assigner_.node_to_check();
}

// Returns false until it is known whether the node-ID is free. Begins the checks of all node-IDs
// that this round may assign together with the first, so that they take no additional time.
bool LssService::check_node_id(Instant now) {
  const std::uint8_t node = *node_to_check();
  const bool promised = is_given_to_another(node);
  if (!promised && check_.use(node) == NodeIdCheck::Use::unknown) {
    check_.begin(node, holding_, now, client());
    for (const lss::Candidate& candidate : assigner_.candidates()) {
      if (!course_runs() && !is_present(candidate.node)) {
        check_.begin(candidate.node, holding_, now, client());
      }
    }
  }
  const NodeIdCheck::Use use = promised ? NodeIdCheck::Use::used : check_.use(node);
  if (use == NodeIdCheck::Use::checking) {
    return false;
  }
  const bool free = use == NodeIdCheck::Use::free;
  const bool unknown = use == NodeIdCheck::Use::cannot_ask;
  if (!course_runs()) {
    unknown ? assigner_.cannot_check() : assigner_.checked(free);
    follow_assigner(now);
    return true;
  }
  if (unknown) {
    finish_command(to_error(check_.may_ask() ? Refusal::busy : Refusal::wrong_state), {}, now);
    return true;
  }
  lss::Course& course = *asked_.front().course;
  course.checked(free);
  if (course.over()) {
    finish_command({}, course.reply(), now);
  }
  return true;
}

void LssService::receive_answer(const lss::Answer& answer, Instant now) {
  number_ = 0;
  if (course_runs()) {
    lss::Course& course = *asked_.front().course;
    course.answered(answer);
    report_progress(course.parts(), now);
    if (course.over()) {
      note_configuration(answer, now);
      if (const auto given = course.given()) {
        await_boot_up(*given, std::nullopt, deadline(now, kHandsOff));
      }
      finish_command({}, course.reply(), now);
    }
    return;
  }
  if (!assigner_.active()) {
    return;
  }
  assigner_.answered(answer);
  follow_assigner(now);
}

void LssService::follow_assigner(Instant now) {
  while (const auto finding = assigner_.take()) {
    report(*finding, now);
    if (lss::has_node_id(finding->verdict)) {
      await_boot_up(finding->node, finding->address, deadline(now, reset_time(finding->node)));
    }
  }
  if (assigner_.nodes_done()) {
    holding_ = false;
  }
  if (!assigner_.active()) {
    finish_round(now);
  }
}

// A command left devices in configuration, or took all devices out of it.
void LssService::note_configuration(const lss::Answer& answer, Instant now) {
  using lss::Procedure;
  const Procedure procedure = asked_.front().procedure;
  const bool into = procedure == Procedure::switch_selective || procedure == Procedure::fastscan;
  if (into || procedure == Procedure::switch_global) {
    deselect();
  }
  if (procedure == Procedure::switch_global) {
    const bool configuration = asked_.front().course->is_into_configuration();
    hands_off_until_ = configuration ? deadline(now, kHandsOff) : now;
    for (Given& given : given_) {
      given.due =
          given.address || configuration ? given.due : deadline(now, reset_time(given.node));
    }
  } else if (into && answer.outcome == lss::Outcome::done) {
    hands_off_until_ = deadline(now, kHandsOff);
  }
}

void LssService::finish_command(Error error, std::vector<std::byte> data, Instant now) {
  const Asked asked = std::move(asked_.front());
  const bool confirmed = asked.procedure != lss::Procedure::switch_global &&
                         asked.procedure != lss::Procedure::activate_bit_timing;
  asked_.pop_front();
  running_ = false;
  if (confirmed) {
    host().reply(asked.tag, error, std::move(data));
    return;
  }
  host().answer_when_sent({.command = {.tag = asked.tag, .request = LssRequest{}},
                           .frames = {{.frame = given_frame_}},
                           .data = std::move(data),
                           .deadline = asked.deadline},
                          now);
}

void LssService::finish_round(Instant now) {
  // A device that waits for its node-ID must not wait for the search for devices connected later.
  const bool waits = std::ranges::any_of(assigner_.found(), [](const lss::Finding& finding) {
    return finding.verdict == lss::Verdict::node_id_not_free ||
           finding.verdict == lss::Verdict::node_id_unchecked;
  });
  const bool none = config_.lss.period == Duration::zero();
  Duration period = none && waits ? LssConfig{}.period : config_.lss.period;
  const bool again = started_ && config_.lss.assign && (period > Duration::zero() || interrupted_);
  period = std::exchange(interrupted_, false) ? Duration::zero() : period;
  next_round_ = again ? deadline(now, period) : kNever;
  hands_off_until_ = now;
  check_.end();
  if (running_) {
    finish_command({}, report_of(assigner_.found()), now);
  }
}

void LssService::report(const lss::Finding& finding, Instant now) {
  events_.emit({.time = now,
                .node = finding.node,
                .data = event::LssResult{.verdict = finding.verdict,
                                         .error = finding.error,
                                         .specific = finding.specific,
                                         .address = finding.address}});
}

void LssService::report_progress(unsigned parts, Instant now) {
  if (!asked_.front().course->is_fastscan() || parts <= reported_parts_) {
    return;
  }
  reported_parts_ = parts;
  events_.emit({.time = now,
                .data = event::CommandProgress{
                    .command = CommandKind::lss, .done = parts, .total = lss::kParts}});
}

// --- devices that were assigned a node-ID -------------------------------------------------------

bool LssService::is_given_to_another(std::uint8_t node) const {
  const auto given = std::ranges::find(given_, node, &Given::node);
  if (given == given_.end()) {
    return false;
  }
  return course_runs() ? !given->selected
                       : given->address != std::optional(assigner_.address_to_check());
}

// Other devices may be in configuration from now on.
void LssService::deselect() {
  for (Given& given : given_) {
    given.selected = false;
  }
}

Duration LssService::reset_time(std::uint8_t node) const {
  const auto found = std::ranges::find(config_.nodes, node, &NodeConfig::id);
  return found != config_.nodes.end() ? found->reset_time : NodeConfig{}.reset_time;
}

void LssService::await_boot_up(std::uint8_t node, const std::optional<lss::Address>& address,
                               Instant due) {
  heartbeat(node);
  given_.push_back(
      {.node = node, .address = address, .due = due, .selected = !address.has_value()});
}

void LssService::boot_up(std::uint8_t node) {
  check_.booted(node);
  heartbeat(node);
}

void LssService::heartbeat(std::uint8_t node) {
  std::erase_if(given_, [node](const Given& each) { return each.node == node; });
}

// Some devices activate their first node-ID only on NMT reset communication. It is sent once, when
// the bus is usable.
void LssService::reset_given(Instant now) {
  if (!usable_) {
    return;
  }
  std::erase_if(given_, [now](const Given& each) { return each.was_reset && now >= each.due; });
  for (Given& given : given_) {
    if (now < given.due) {
      continue;
    }
    given.was_reset = true;
    given.due = deadline(now, reset_time(given.node));
    nmt_.send_nmt(nmt::Command::reset_communication, given.node, now);
    report({.verdict = lss::Verdict::reset_to_boot, .node = given.node, .address = given.address},
           now);
  }
}

// --- frames and time ----------------------------------------------------------------------------

void LssService::completed(sdo::Completion& completion, Instant now) {
  check_.completed(completion, now);
  pump(now);
}

bool LssService::receive(const can::Frame& frame) {
  sdo_.charge(client(), 1);
  const bool good = master_.receive(frame);
  pump(frame.time);
  stuck_at_ = holding_ ? deadline(frame.time, kStuck) : kNever;
  start_network(frame.time);
  return good;
}

void LssService::advance(Instant now) {
  const bool usable = host().usable();
  if (usable && !usable_) {
    interface_back(now);
  }
  usable_ = usable;
  master_.advance(now);
  expire(now);
  release_if_stuck(now);
  reset_given(now);
  pump(now);
  start_network(now);
  look_again(now);
}

void LssService::release_if_stuck(Instant now) {
  const bool stuck = now >= stuck_at_ && wants_to_send();
  if (holding_ && (stuck || !usable_ || now >= hold_until_)) {
    holding_ = false;
  }
  if (!holding_) {
    stuck_at_ = kNever;
  } else if (now >= stuck_at_) {
    stuck_at_ = deadline(now, kStuck);
  }
}

// Ends the command or round under way without a reply.
void LssService::end_running() {
  master_.cancel();
  assigner_.end_early();
  running_ = false;
}

// The results about devices and node-IDs are void when the bus returns: other devices may have been
// connected.
void LssService::interface_lost() {
  usable_ = false;
  number_ = 0;
  interrupted_ = interrupted_ || (assigner_.active() && !running_ && !assigner_.nodes_done());
  end_running();
  check_.end();
  for (const Asked& asked : asked_) {
    host().reply(asked.tag, to_error(Refusal::line_down), {});
  }
  asked_.clear();
}

// The boot-up message of a device that booted meanwhile was missed; its error control will be
// received.
void LssService::interface_back(Instant now) {
  for (Given& given : given_) {
    given.due = std::max(given.due, deadline(now, reset_time(given.node)));
  }
}

void LssService::expire(Instant now) {
  if (now >= unsent_at_ && is_paced()) {
    unsent_at_ = deadline(now, kSendTime);  // the frame waits for the share of its client
  }
  if (now >= unsent_at_ && course_runs() && is_unsent()) {
    host().reply(asked_.front().tag, to_error(Refusal::no_acknowledge), {});
    end_running();
    asked_.pop_front();
  }
  unsent_at_ = now >= unsent_at_ ? kNever : unsent_at_;
  for (std::size_t i = 0; i < asked_.size();) {
    if (asked_[i].deadline > now) {
      ++i;
      continue;
    }
    if (i == 0 && running_) {
      end_running();
    }
    host().reply(asked_[i].tag, to_error(Refusal::timed_out), {});
    asked_.erase(asked_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

Instant LssService::next_wake() const {
  Instant wake = earlier(earlier(master_.next_wake(), stuck_at_), earlier(unsent_at_, retry_at_));
  wake = holding_ ? earlier(wake, hold_until_) : wake;
  for (const Given& given : given_) {
    wake = usable_ ? earlier(wake, given.due) : wake;
  }
  if (usable_ && !master_.busy() && !node_to_check() && check_.may_ask()) {
    wake = earlier(wake, std::max(next_round_, hands_off_until_));
  }
  for (const Asked& asked : asked_) {
    wake = earlier(wake, asked.deadline);
  }
  return wake;
}

bool LssService::next_frame(can::Frame& out, std::uint64_t number, Instant now) {
  if (!is_permitted() || !master_.next_frame(out, now, number != 0)) {
    return false;
  }
  sdo_.charge(client(), 1);
  look_again(now);
  sent_.add(out);
  given_frame_ = out;
  given_at_ = now;
  number_ = number;
  lost_ = false;
  stuck_at_ = holding_ ? deadline(now, kStuck) : kNever;
  unsent_at_ = is_unsent() ? deadline(now, kSendTime) : kNever;
  pump(now);
  start_network(now);
  return true;
}

// The time-out of a service starts here: no device can have responded earlier.
void LssService::acknowledged(std::uint64_t number, Instant now) {
  check_.acknowledged(number, now);
  if (number_ == 0 || number < number_ || lost_) {
    return;
  }
  number_ = 0;
  stuck_at_ = holding_ ? deadline(now, kStuck) : kNever;
  unsent_at_ = master_.wants_to_send() ? unsent_at_ : kNever;
  master_.sent(now);
}

void LssService::lost(std::uint64_t first, std::uint64_t last) {
  check_.lost(first, last);
  if (number_ < first || number_ > last || lost_) {
    return;
  }
  if (course_runs()) {
    lost_ = true;
  } else {
    number_ = 0;
    master_.sent(given_at_);
  }
}

}  // namespace linegate::line
