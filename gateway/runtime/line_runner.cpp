// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/line_runner.h"

#include <algorithm>
#include <cerrno>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/runtime/assertion_report.h"
#include "stack/base/assert.h"
#include "stack/od/objects.h"

namespace linegate::gateway {
namespace {

constexpr Duration kStatusPeriod = std::chrono::milliseconds(100);
// Images and status are delayed this long after values were forwarded. If the consumer shares a
// processor with another executor that sends them, it would otherwise wake up before it; within one
// executor, a frame that is received meanwhile would wait for them. A due image thus also leaves
// the phase of PDOs that are received periodically.
constexpr Duration kAfterForwarding = std::chrono::microseconds(100);
// The time limit for the last frames and events of a line that stops.
constexpr Duration kStopTime = std::chrono::milliseconds(500);
// Time until a full link to another line is tried again.
constexpr Duration kLinkFull = std::chrono::milliseconds(1);
constexpr Duration kLong = std::chrono::hours(24 * 365);

// The SYNC period of the own node; 0 if it does not produce SYNC.
Duration produced_sync(const line::Line& line) {
  constexpr std::uint64_t kProduces = 1U << 30U;  // bit of 1005h
  if (line.config().role == line::Role::observer) {
    return {};
  }
  const std::uint64_t cob_id = line.dictionary().number({od::objects::kSyncCobId, 0}).value_or(0);
  const std::uint64_t period = line.dictionary().number({od::objects::kSyncPeriod, 0}).value_or(0);
  return (cob_id & kProduces) != 0 ? std::chrono::microseconds(period) : Duration::zero();
}

line::BudgetOptions budget_of(const line::LineConfig& config) {
  return {.bit_rates = {config.bit_rate, config.data_bit_rate},
          .canopen_fd = config.canopen_fd,
          .emcy_fd = config.emcy_fd,
          .share = config.request_share,
          .client_share = config.client_share};
}

// The rate of synchronous PDOs does not depend on clients (CiA 301 7.5.2.37).
bool is_event_driven(const line::Line& line, std::uint16_t tpdo) {
  constexpr std::uint64_t kFirstEventDriven = 0xFE;
  const auto index = static_cast<std::uint16_t>(od::objects::kTpdoCommunication + tpdo - 1U);
  return tpdo != 0 &&
         line.dictionary().number({index, 2}).value_or(kFirstEventDriven) >= kFirstEventDriven;
}

void follow_outputs(const line::Line& line, line::RequestBudget& budget) {
  const image::Layout& layout = line.layout(image::Direction::outputs);
  std::vector<bool> event_driven;
  for (const image::Entry& entry : layout.entries) {
    event_driven.push_back(line.config().role == line::Role::manager
                               ? is_event_driven(line, entry.local_pdo)
                               : entry.local_pdo != 0);
  }
  budget.set_outputs(layout, event_driven);
}

bool wants_fd(const line::Command& command) {
  const auto* const send = std::get_if<line::CanSend>(&command.request);
  return send != nullptr && send->frame.fd();
}

}  // namespace

bool Publication::due(const line::Line& line, image::Direction direction, Instant now) {
  return next(line, direction) <= now;
}

[[gnu::hot]] Instant Publication::next(const line::Line& line, image::Direction direction) {
  if (first_) {
    return last_;
  }
  switch (rule_.rule) {
    case config::Publish::Rule::on_change:
      changed_ = changed_ || line.image_changed(direction);
      if (changed_) {
        return last_ + rule_.time;
      }
      return line.image_touched(direction) ? last_ + touched_period_ : kNever;
    case config::Publish::Rule::on_sync:
      return line.sync_count() != last_sync_ ? last_ : kNever;
    case config::Publish::Rule::period:
      break;
  }
  return last_ + rule_.time;
}

void Publication::taken(const line::Line& line, Instant now) {
  // Periodic publication keeps its phase unless it is late by more than a period.
  const bool in_rhythm =
      !first_ && rule_.rule == config::Publish::Rule::period && now - last_ < 2 * rule_.time;
  in_series_ = !first_ && rule_.rule == config::Publish::Rule::on_change &&
               now - last_ < rule_.time + rule_.time / 4;
  last_ = in_rhythm ? last_ + rule_.time : now;
  last_sync_ = line.sync_count();
  first_ = false;
  changed_ = false;
}

LineRunner::LineRunner(std::unique_ptr<line::Line> line,
                       std::unique_ptr<can_bridge::Channel> channel, const config::LinePlan& plan,
                       LinePort& port, exchange::Wakeup& consumer, std::vector<NodeStorage> storage)
    : budget_(std::make_unique<line::RequestBudget>(budget_of(plan.config))),
      line_(std::move(line)),
      direct_(port.direct.get()),
      has_queues_(line::longest_queue(plan.config) != 0),
      publications_{Publication(plan.publish, plan.pdo_min_period),
                    Publication(plan.publish, kLong)},
      scans_(plan, port.scans),
      pump_(std::move(channel)),
      port_(port),
      consumer_(consumer),
      storage_(std::move(storage)) {
  line_->expect_acknowledgements();
  line_->set_pace(*budget_);
  follow_outputs(*line_, *budget_);
  for (const NodeStorage& storage_of : storage_) {
    line_->set_medium(storage_of.file, storage_of.of);
  }
}

void LineRunner::bind(std::vector<BoundSource> sources, std::vector<BoundTarget> targets) {
  bound_sources_ = std::move(sources);
  bound_targets_ = std::move(targets);
  inputs_changed_ = true;
}

[[gnu::hot]] bool LineRunner::has_values() const {
  return std::any_of(bound_targets_.begin(), bound_targets_.end(),
                     [](const BoundTarget& target) { return target.has_values(); });
}

void LineRunner::unbind(const BoundLink& link, Instant now) {
  const RunningLine running(*line_);
  if (started_ && !stopping_) {
    for (BoundTarget& target : bound_targets_) {
      if (&target.link() == &link && target.take(*line_, std::max(now, known_))) {
        inputs_changed_ = true;
        wake_at(now);
      }
    }
  }
  std::erase_if(bound_sources_, [&](const BoundSource& source) { return source.is_of(link); });
  std::erase_if(bound_targets_, [&](const BoundTarget& target) { return &target.link() == &link; });
}

void LineRunner::set_routes(const routing::Config& wanted, Instant now) {
  const RunningLine running(*line_);
  line_->set_routes(wanted, std::max(now, known_));
  wake_at(now);
}

[[gnu::hot]] void LineRunner::service(Instant now) {
  const RunningLine running(*line_);
  now = std::max(now, known_);  // values of another line may have been sent at a later time
  const bool reads = needs_reading(now);
  if (!reads && is_only_for_images(now)) {
    hand_over(now);
    note_next_due();
    next_wake_ = compute_next_wake();
    return;
  }
  const Instant known = reads ? receive(now) : now;
  now = std::max(now, known);  // frames were received while the channel was read
  fill_budget(known);
  note_next_due();
  if (called_ || budget_due_ <= known) {
    poll_calls(known);  // after the frames received earlier: the line's time never goes back
    inputs_changed_ = true;
  }
  if (scans_.next_wake() <= now) {
    start_scan(known);
  }
  const bool routes = routes_ != nullptr;  // read once: most lines do not route
  if (routes) [[unlikely]] {
    poll_messages(known);
  }
  if (started_) {
    inputs_changed_ |= line_->advance(known);
    for (BoundTarget& target : bound_targets_) {
      if (target.take(*line_, known)) {
        inputs_changed_ = true;
        forwarded_ = true;
      }
    }
    if (routes) [[unlikely]] {
      give_messages(known);  // before frames are sent: other lines wait for them
    }
  }
  if (std::exchange(inputs_changed_, !started_)) {
    look_at_sources(now);  // time-outs and requests change values, too
  }
  transmit(now);
  if (routes) [[unlikely]] {
    give_messages(now);
    give_gateway_requests();
  }
  hand_over(now);
  note_next_due();
  next_wake_ = compute_next_wake();
  if (pump_.more()) {
    wake_at(now);
  }
  if ((routes && routes_->held()) || receptions_wait_) [[unlikely]] {
    next_wake_ = earlier(next_wake_, now + kLinkFull);
  }
}

// Time-outs expire, and requests are carried out, only after the frames that were received earlier.
[[gnu::hot]] bool LineRunner::needs_reading(Instant now) {
  const bool nothing_to_read = std::exchange(nothing_to_read_, false);
  return !nothing_to_read || called_ || now >= work_due_ ||
         (routes_ != nullptr && routes_->arrived());
}

// Precondition: the channel need not be read. With the status, the line is advanced, too.
[[gnu::hot]] bool LineRunner::is_only_for_images(Instant now) const {
  return started_ && !stopping_ && (!inputs_changed_ || bound_sources_.empty()) &&
         !receptions_wait_ && now < status_due_ && !has_values() &&
         (routes_ == nullptr || !routes_->held());
}

// Returns the time up to which everything was received.
[[gnu::hot]] Instant LineRunner::receive(Instant now) {
  const Instant known = pump_.drain(
      now,
      [&](std::span<const can::Frame> frames) {
        if (started_ && !lacks_fd_) {
          const Instant time = std::max(now, frames.back().time);
          fill_budget(time);
          line_->receive(frames, time);
        }
      },
      [&](const can::BusEvent& event) { bus_event(event, now); },
      [&](Instant until) { report_ended(until); });
  report_ended(known);
  receive_peak_ = std::max(receive_peak_, static_cast<std::uint32_t>(pump_.drained()));
  if (pump_.drained() > 0) {
    look_at_sources(std::max(now, known));  // first, because the bus of another line waits
  }
  return known;
}

// Before frames are counted: those counted at an earlier time would be refilled for the time since.
[[gnu::hot]] void LineRunner::fill_budget(Instant now) {
  if (budget_->is_in_use()) {
    budget_->advance(now);
  }
}

[[gnu::hot]] void LineRunner::note_next_due() {
  if (budget_->pop_next_due()) {
    budget_due_ = Instant{};
  }
}

[[gnu::hot]] exchange::Wakeup* LineRunner::announce() {
  if (direct_ != nullptr) {
    direct_->announce();
  }
  return std::exchange(handed_over_, false) ? &consumer_ : nullptr;
}

[[gnu::hot]] void LineRunner::look_at_sources(Instant now) {
  for (BoundSource& source : bound_sources_) {
    forwarded_ |= source.look(*line_, now);
  }
}

[[gnu::hot]] void LineRunner::transmit(Instant now) {
  if (started_ && !lacks_fd_) {
    known_ = std::max(known_, now);
    fill_budget(now);
    if (pump_.transmit(now, [&](can::Frame& frame) { return line_->next_frame(frame, now); })) {
      report_ended(now);
    }
  }
}

// Called after transmitting, too: some buses acknowledge immediately.
[[gnu::hot]] void LineRunner::report_ended(Instant now) {
  pump_.report_ended([&](std::uint64_t number) { line_->acknowledged(number, now); },
                     [&](std::uint64_t first, std::uint64_t last) { line_->lost(first, last); });
}

[[gnu::hot]] bool LineRunner::receive_bound(const BoundLink& link,
                                            std::span<const line::Line::Input> values,
                                            Instant now) {
  if (!started_ || stopping_) {
    return false;
  }
  const RunningLine running(*line_);
  now = std::max(now, known_);  // this line may have advanced further than the calling line
  for (BoundTarget& target : bound_targets_) {
    if (&target.link() != &link || !target.write(*line_, values, now)) {
      continue;
    }
    inputs_changed_ = true;
    const bool waited = wants_writable();
    transmit(now);
    image_due_ = next_image();
    hold_snapshot(now);
    next_wake_ = wants_writable() == waited ? earlier(next_wake_, compute_next_wake()) : now;
  }
  return true;
}

// An interface without CAN FD is no interface for a line of CANopen FD: whatever else it reports
// is not for the line.
std::optional<can::BusEvent> LineRunner::as_usable(can::BusEvent event) {
  using Kind = can::BusEvent::Kind;
  if (event.kind == Kind::interface_ready) {
    lacks_fd_ = line_->config().canopen_fd && !pump_.channel().carries_fd();
    if (lacks_fd_) {
      event.kind = Kind::interface_failed;
      event.code = EMSGSIZE;
    }
  } else if (lacks_fd_ && event.kind != Kind::interface_failed) {
    return std::nullopt;
  }
  return event;
}

void LineRunner::bus_event(const can::BusEvent& reported, Instant now) {
  const std::optional<can::BusEvent> usable = as_usable(reported);
  if (!usable) {
    return;
  }
  const can::BusEvent& event = *usable;
  line_->bus_event(event);
  status_wanted_ = true;
  if (event.kind == can::BusEvent::Kind::interface_ready) {
    const can_bridge::ControllerSetup settings = pump_.channel().settings();
    line_->set_bit_rates(settings.bit_rate, settings.data_bit_rate);
    const line::LineConfig& config = line_->config();
    budget_->set_bit_rates(
        {.nominal = config.bit_rate != 0 ? config.bit_rate : settings.bit_rate,
         .data = config.data_bit_rate != 0 ? config.data_bit_rate : settings.data_bit_rate});
  }
  // The line starts when its interface is ready for the first time: it cannot manage a network
  // without one.
  if (event.kind == can::BusEvent::Kind::interface_ready && !started_ && !stopping_) {
    started_ = true;
    line_->start(now);
    scans_.started(now);
    called_ = true;  // commands may have been waiting
  }
}

[[gnu::hot]] void LineRunner::poll_storage_results() {
  for (const NodeStorage& storage : storage_) {
    if (const auto good = storage.file->pop_result()) {
      line_->medium_done(*good, storage.of);
    }
  }
}

// Commands stay in their ring while a reply waits for room, or a scan holds them.
[[gnu::hot]] void LineRunner::poll_calls(Instant now) {
  poll_storage_results();
  poll_gateways(now);
  poll_requests(now);
  called_ = reply_held_ || scans_.holds(now);
}

void LineRunner::start_scan(Instant now) {
  if (!started_ || stopping_) {
    return;
  }
  if (auto scan = scans_.due(now)) {
    line_->execute(*std::move(scan), now);
  }
}

[[gnu::hot]] void LineRunner::poll_requests(Instant now) {
  budget_->advance(now);
  // Commands and outputs that wait take turns: neither uses up the share of the line every time.
  if (std::exchange(commands_first_, !commands_first_)) {
    execute_admitted_commands(now);
    write_held_outputs(now);
  } else {
    write_held_outputs(now);
    execute_admitted_commands(now);
  }
  // One by one: commands behind a scan that is applied stay in the ring, for the line that is made
  // with its result.
  while (!reply_held_ && (stopping_ || !scans_.holds(now)) && port_.commands.pop(command_)) {
    queue_command(now);
    execute_admitted_commands(now);
  }
  poll_interface_commands(now);
  for (Event notice; port_.notices.pop(notice);) {
    notice.time = now;
    line_->report(notice);
  }
  poll_outputs(now);
  while (const auto report = budget_->pop_report(now)) {
    line_->report({.time = now, .data = *report});
  }
  const bool held = reply_held_ || scans_.holds(now);  // another input ends that
  budget_due_ = held ? kNever : budget_->next_wake();
}

void LineRunner::queue_command(Instant now) {
  using Put = line::RequestBudget::Put;
  const event::CommandRefused refused{
      .refusal = line::Refusal::busy, .command = line::kind(command_), .client = command_.client};
  const Put put = budget_->put(command_, now);
  if (put == Put::queued) {
    return;
  }
  if (put == Put::no_place) {
    line_->report({.time = now, .data = refused});
  }
  reply(command_.tag, line::to_error(line::Refusal::busy));
}

[[gnu::hot]] void LineRunner::execute_admitted_commands(Instant now) {
  while (stopping_ && !reply_held_ && budget_->remove(command_)) {
    execute_command(now);
  }
  while (!stopping_ && !reply_held_ && !scans_.holds(now) && budget_->next(admitted_, now)) {
    command_ = std::move(admitted_.command);
    if (admitted_.late) {
      reply(command_.tag, line::to_error(line::Refusal::timed_out));
    } else {
      execute_command(now);
    }
  }
}

// A write that exceeds the share of its client waits, unless the line refuses it: that costs
// nothing on the bus.
[[gnu::hot]] void LineRunner::poll_outputs(Instant now) {
  using Admission = line::RequestBudget::Admission;
  while (port_.outputs.pop(write_)) {
    if (stopping_) {
      continue;
    }
    if (write_.forwarded) {  // a value of another gateway is no request of a client
      (void)line_->write_outputs(write_, now);
      continue;
    }
    const Admission admission = budget_->admits(write_);
    if (admission == Admission::no_place) {
      line_->report({.time = now,
                     .data = event::OutputRefused{.refusal = line::OutputRefusal::busy,
                                                  .group = write_.group,
                                                  .client = write_.client_number}});
    } else if (admission == Admission::later && line_->feed_watchdog(write_, now)) {
      budget_->hold(write_, now);
    } else if (line_->write_outputs(write_, now) == line::OutputRefusal::none) {
      budget_->applied(write_);
    }
  }
}

[[gnu::hot]] void LineRunner::write_held_outputs(Instant now) {
  while (!stopping_ && budget_->next_output(write_)) {
    (void)line_->write_outputs(write_, now);  // the line reports a refusal itself
  }
}

// Another command may wait for the node.
void LineRunner::answered(std::uint64_t tag) {
  budget_->answered(tag);
  if (budget_->waiting() != 0) {
    budget_due_ = Instant{};
  }
}

// The line does not receive these commands.
void LineRunner::report_accepted(const request::GatewayCommand& command, Instant now) {
  if (command.audited) {
    line_->report({.time = now,
                   .data = event::CommandAccepted{.command = request::kind(command.request),
                                                  .client = command.client}});
  }
}

// They send nothing on the bus, so they neither use nor wait for the share of a client.
[[gnu::hot]] void LineRunner::poll_interface_commands(Instant now) {
  request::GatewayCommand command;
  while (!reply_held_ && port_.interface_commands.pop(command)) {
    if (stopping_) {
      reply(command.tag, line::to_error(line::Refusal::cancelled));
    } else if (!started_) {
      reply(command.tag, line::to_error(line::Refusal::line_down));
    } else if (const auto* const fault = std::get_if<request::BusFault>(&command.request)) {
      change_faults(command, fault->change, now);
    } else {
      LINEGATE_ASSERT(std::holds_alternative<request::BusRestart>(command.request),
                      "other commands of the gateway do not reach an interface");
      restart_bus(command, now);
    }
  }
}

void LineRunner::execute_command(Instant now) {
  const bool bound = !bound_sources_.empty() || !bound_targets_.empty();
  if (stopping_) {
    reply(command_.tag, line::to_error(line::Refusal::cancelled));
  } else if (!started_ || lacks_fd_) {
    reply(command_.tag, line::to_error(line::Refusal::line_down));
  } else if (bound && std::holds_alternative<line::ScanApply>(command_.request)) {
    reply(command_.tag,
          line::to_error(line::Refusal::wrong_state));  // a bound line cannot be made anew alone
  } else if (wants_fd(command_) && !pump_.channel().carries_fd()) {
    reply(command_.tag, line::to_error(line::Refusal::wrong_interface));
  } else {
    scans_.asked(command_);
    line_->execute(std::move(command_), now);
    command_ = {};
  }
}

// Precondition of this and of the next: the line routes.
void LineRunner::poll_messages(Instant now) {
  routes_->take([&](const routing::Message& message) { line_->deliver(message, now); });
}

void LineRunner::give_messages(Instant now) {
  routes_->give([&](routing::Message& message) { return line_->pop_message(message); },
                [&](const routing::Message& message) { line_->deliver(message, now); });
}

// Of other gateways: their presence, their answers, and their EMCYs.
[[gnu::hot]] void LineRunner::poll_gateways(Instant now) {
  if (routes_ == nullptr || port_.peers == nullptr) {
    return;
  }
  if (auto* const present = port_.gateways_present.fetch()) {
    line_->set_present_gateways(*present);
  }
  while (port_.gateway_answers.pop(gateway_answer_)) {
    line_->answer_gateway_request(std::move(gateway_answer_), now);
    gateway_answer_ = {};
  }
  for (routing::Message emcy; port_.gateway_emcys.pop(emcy);) {
    line_->deliver(emcy, now);
  }
  for (Event notice; port_.gateway_notices.pop(notice);) {
    notice.time = now;
    line_->report(notice);
  }
}

// While the ring is full they stay in the line, which gives them up at their deadlines. The thread
// that takes them wakes the executor.
void LineRunner::give_gateway_requests() {
  if (port_.peers == nullptr) {
    return;
  }
  bool given = false;
  while (port_.gateway_requests.room() > 0 && line_->pop_gateway_request(gateway_request_)) {
    LINEGATE_ASSERT(port_.gateway_requests.push(gateway_request_), "there is room");
    gateway_request_ = {};
    given = true;
  }
  if (given) {
    port_.peers->signal();
  }
}

void LineRunner::leave(std::uint8_t interface, Instant now) {
  const RunningLine running(*line_);
  poll_messages(now);
  routes_->remove(interface,
                  [&](const routing::Message& message) { line_->deliver(message, now); });
  give_messages(now);
}

void LineRunner::restart_bus(const request::GatewayCommand& command, Instant now) {
  const int error = pump_.channel().restart(now);
  if (error == 0) {
    report_accepted(command, now);
  }
  if (error == EBUSY) {
    reply(command.tag, line::to_error(line::Refusal::wrong_state));
  } else {
    reply(command.tag,
          error == 0 ? Error{} : Error{Domain::can, static_cast<std::uint32_t>(error)});
  }
}

void LineRunner::change_faults(const request::GatewayCommand& command, std::string_view change,
                               Instant now) {
  std::string said;
  switch (const int error = pump_.channel().fault(change, said, now)) {
    case 0:
      report_accepted(command, now);
      return reply(command.tag, Error{}, said);
    case EINVAL:
      return reply(command.tag, line::to_error(line::Refusal::bad_request), said);
    case EOPNOTSUPP:
      return reply(command.tag, line::to_error(line::Refusal::wrong_interface));
    default:
      return reply(command.tag, Error{Domain::can, static_cast<std::uint32_t>(error)});
  }
}

void LineRunner::reply(std::uint64_t tag, Error error, std::string_view text) {
  LINEGATE_ASSERT(!reply_held_, "one reply is held back at a time");
  reply_ = {};
  reply_.tag = tag;
  reply_.error = error;
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  reply_.data = std::vector(bytes, bytes + text.size());
  reply_held_ = true;
  answered(tag);
  hand_over_events();  // events of earlier replies are published together with them
  hand_over_replies();
}

// A due snapshot is delayed only once, whatever is forwarded meanwhile.
[[gnu::hot]] bool LineRunner::is_snapshot_due(Instant now) {
  const bool forwarded = std::exchange(forwarded_, false);
  image_due_ = next_image();
  if (image_expected_ <= now) {
    image_expected_ = expected_image(now);
  }
  if (earlier(status_due_, image_due_) > now) {
    return false;
  }
  if (forwarded) {
    hold_snapshot(now);
  }
  if (now < held_until_) {
    return false;
  }
  held_until_ = {};
  return true;
}

// Values were forwarded: delays a snapshot that is due.
[[gnu::hot]] void LineRunner::hold_snapshot(Instant now) {
  if (held_until_ == Instant{} && earlier(status_due_, image_due_) <= now) {
    held_until_ = now + kAfterForwarding;
  }
}

[[gnu::hot]] void LineRunner::hand_over(Instant now) {
  const bool due = is_snapshot_due(now);
  if (reply_held_ || line_->has_news()) {
    hand_over_events();
    hand_over_replies();
  }
  if (has_queues_) {
    hand_over_receptions();
  }
  if (due && now >= status_due_) {
    look_at_clock();
    look_at_losses();
    hand_over_events();
    hand_over_routes();
    hand_over_layouts();
    status_wanted_ = true;
  }
  if (status_wanted_) {
    hand_over_status(now);
  }
  if (due && image_due_ <= now) {
    hand_over_layouts();
    hand_over_images(now);
    image_due_ = next_image();
    image_expected_ = expected_image(now);
  }
}

void LineRunner::hand_over_events() {
  for (;;) {
    const std::size_t room = std::min(port_.events.room(), events_.size());
    const std::size_t count = line_->pop_events(std::span<Event>(events_.data(), room));
    for (std::size_t i = 0; i < count; ++i) {
      if (events_[i].kind() == EventKind::boot_up) {
        scans_.booted_up(events_[i].node, events_[i].time);
      }
      LINEGATE_ASSERT(port_.events.push(events_[i]), "no more events than there is room for");
    }
    if (count == 0) {
      return;
    }
    handed_over_ = true;
    status_wanted_ = true;
  }
}

void LineRunner::hand_over_replies() {
  while (reply_held_ || line_->pop_reply(reply_)) {
    if (!reply_held_) {
      answered(reply_.tag);
      if (scans_.answered(reply_)) {
        continue;
      }
    }
    reply_held_ = !port_.replies.push(reply_);
    if (reply_held_) {
      return;
    }
    handed_over_ = true;
  }
}

// The layout of the receptions is handed over before them.
[[gnu::hot]] void LineRunner::hand_over_receptions() {
  hand_over_layouts();
  std::size_t room = port_.receptions.room();
  for (; room > 0 && line_->pop_reception(reception_); --room) {
    LINEGATE_ASSERT(port_.receptions.push(reception_), "no more than there is room for");
    handed_over_ = true;
  }
  receptions_wait_ = room == 0;
}

void LineRunner::hand_over_status(Instant now) {
  for (std::uint8_t node = 1; node < revisions_.size(); ++node) {
    const std::uint64_t revision = line_->node_revision(node);
    if (revision != revisions_[node] &&
        port_.nodes.push(NodeStatus{line_->node_state(node), line_->own_device(node), now})) {
      revisions_[node] = revision;
    }
  }
  hand_over_outputs(now);
  auto draft = port_.status.draft();
  QueueDepths queues{std::exchange(receive_peak_, 0), static_cast<std::uint32_t>(pump_.held()),
                     pump_.channel().counters().stalled,
                     static_cast<std::uint32_t>(port_.events.capacity() - port_.events.room()),
                     routes_ != nullptr ? routes_->stalls() : 0};
  if (draft.unread) {
    queues.merge(draft.value.queues);
  }
  draft.value.queues = queues;
  draft.value.controller = pump_.channel().settings();
  draft.value.sync_period = produced_sync(*line_);
  draft.value.state = line_->state();
  // Malformed datagrams of the interface never reached the line.
  draft.value.state.counters.frames_malformed += pump_.channel().counters().malformed;
  draft.value.time = now;
  port_.status.publish();
  handed_over_ = true;
  status_wanted_ = false;
  status_due_ = now + kStatusPeriod;
}

void LineRunner::hand_over_outputs(Instant now) {
  const std::size_t groups = line_->output_groups();
  if (groups == 0) {
    return;
  }
  auto draft = port_.outputs_status.draft();
  draft.value.groups.resize(groups);
  for (std::size_t i = 0; i < groups; ++i) {
    line_->output_state(i, draft.value.groups[i]);
  }
  draft.value.time = now;
  port_.outputs_status.publish();
}

void LineRunner::hand_over_layouts() {
  if (std::exchange(layout_revision_, line_->layout_revision()) == line_->layout_revision()) {
    return;
  }
  for (Publication& publication : publications_) {
    publication.image_replaced();
  }
  auto draft = port_.layouts.draft();
  draft.value = {line_->layout(image::Direction::inputs), line_->layout(image::Direction::outputs)};
  port_.layouts.publish();
  handed_over_ = true;
}

// Compares, because 1F2Ch may be written by SDO. Allocates nothing while the routes are unchanged.
void LineRunner::hand_over_routes() {
  if (routes_ == nullptr) {
    return;
  }
  line_->routes(routes_now_);
  if (routes_now_ == routes_shown_) {
    return;
  }
  routes_shown_ = routes_now_;
  port_.routes.draft().value = routes_now_;
  port_.routes.publish();
  handed_over_ = true;
}

void LineRunner::hand_over_images(Instant now) {
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    hand_over_image(direction, now);
  }
}

void LineRunner::hand_over_image(image::Direction direction, Instant now) {
  auto& publication = publications_[static_cast<std::size_t>(direction)];
  if (!publication.due(*line_, direction, now)) {
    if (direct_ != nullptr) {
      direct_->publish_waiting(direction, clock_.map(), now);
    }
    return;
  }
  auto& slot = port_.image(direction);
  if (direct_ != nullptr) {
    line_->snapshot(direction, direct_->draft(direction), now, false);
    handed_over_ |= direct_->taken(direction, clock_.map(), now, slot);
    publication.taken(*line_, now);
    return;
  }
  auto draft = slot.draft();
  line_->snapshot(direction, draft.value, now, draft.unread);
  slot.publish();
  publication.taken(*line_, now);
  handed_over_ = true;
}

void LineRunner::look_at_clock() {
  const Duration step = clock_.refresh();
  line_->set_utc(clock_.map().offset);
  if (step == Duration::zero()) {
    return;
  }
  line_->report({.time = monotonic_now(),
                 .data = event::ClockStep{std::chrono::abs(
                     std::chrono::duration_cast<std::chrono::milliseconds>(step))}});
}

void LineRunner::look_at_losses() {
  const std::uint64_t lost = port_.requests_lost.value();
  if (lost == losses_reported_) {
    return;
  }
  const auto more = static_cast<std::uint32_t>(lost - std::exchange(losses_reported_, lost));
  line_->report({.time = monotonic_now(),
                 .data = event::QueueFull{.queue = event::Queue::requests, .lost = more}});
}

[[gnu::hot]] Instant LineRunner::compute_next_wake() {
  work_due_ = earlier(pump_.channel().next_wake(), budget_due_);
  if (started_) {
    work_due_ = earlier(work_due_, earlier(line_->next_wake(), scans_.next_wake()));
  }
  if (stopping_) {
    work_due_ = earlier(work_due_, stop_deadline_);
  }
  return earlier(earlier(work_due_, image_expected_),
                 std::max(earlier(status_due_, image_due_), held_until_));
}

[[gnu::hot]] Instant LineRunner::next_image() {
  const Instant next = earlier(publications_[0].next(*line_, image::Direction::inputs),
                               publications_[1].next(*line_, image::Direction::outputs));
  return direct_ == nullptr ? next : earlier(next, direct_->next_try());
}

void LineRunner::stop(Instant now) {
  if (stopping_) {
    return;
  }
  const RunningLine running(*line_);
  stopping_ = true;
  stop_deadline_ = now + kStopTime;
  if (started_) {
    line_->stop(now);
  }
  wake_at(now);
}

bool LineRunner::stopped(Instant now) const {
  if (!stopping_ || now >= stop_deadline_) {
    return stopping_;
  }
  const bool image_waits = direct_ != nullptr && direct_->next_try() != kNever;
  return !image_waits && !reply_held_ && budget_->waiting() == 0 && pump_.held() == 0 &&
         (routes_ == nullptr || !routes_->held()) &&
         (!started_ || lacks_fd_ || !line_->wants_to_send(now)) && !line_->is_ending();
}

}  // namespace linegate::gateway
