// SPDX-License-Identifier: Apache-2.0
// The part of the answer model for unconfirmed services: a frame that is answered as sent was
// acknowledged on the bus, and every other reply has the reason of the delay.
#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/repeat_limit.h"
#include "stack/nmt/node_control.h"
#include "stack/pdo/mpdo.h"
#include "stack/pdo/parameters.h"

#include "tests/plant/answer_model.h"
#include "tests/plant/output_fields.h"
#include "tests/plant/request_fields.h"

namespace linegate::plant {
namespace {

constexpr Duration kAnswerGrace = std::chrono::milliseconds(1);

std::uint64_t number_of(std::span<const std::byte> data) {
  std::uint64_t out = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(data.size(), 8); ++i) {
    out |= std::uint64_t{std::to_integer<unsigned>(data[i])} << (8 * i);
  }
  return out;
}

bool bit_of(std::span<const std::byte> bytes, unsigned bit) {
  return (bytes[bit / 8] >> (bit % 8) & std::byte{1}) != std::byte{0};
}

std::uint64_t carried(const can::Frame& frame, unsigned bit, unsigned bits) {
  if (bit + bits > 8 * can::kMaxClassicData) {
    return bits_of(frame.data, bit, bits);
  }
  const std::uint64_t all = number_of(std::span(frame.data).first(can::kMaxClassicData));
  return all >> bit & (bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1);
}

}  // namespace

AnswerModel::AnswerModel(line::Line& line) : line_(line) {
  constexpr od::Address kStartup{0x1F80, 0};
  const image::Layout& layout = line.layout(image::Direction::outputs);
  fields_.resize(layout.entries.size());
  writes_.resize(layout.entries.size());
  may_be_slave_ = line.config().role != line::Role::manager ||
                  std::ranges::any_of(line.config().own_values,
                                      [&](const auto& value) { return value.address == kStartup; });
  for (const line::NodeConfig& node : line.config().nodes) {
    const Loaded<pdo::DevicePdos> described = pdos_in(node.device, line.config().canopen_fd);
    for (const pdo::Parameters& rpdo : described.value->rpdos) {
      each_output(layout, node.id, rpdo, [&](std::size_t i, od::Address, unsigned bit) {
        fields_[i] = {.cob_id = rpdo.cob_id,
                      .pdo = rpdo.number,
                      .bit = bit,
                      .bits = layout.entries[i].bit_length};
      });
    }
  }
}

// --- commands -----------------------------------------------------------------------------------

void AnswerModel::commanded(const line::Command& command, Instant now) {
  constexpr std::uint8_t kFatalError = 0x90;  // stack/diagnosis/network_state.h
  const auto* const control = as<line::NmtRequest>(command);
  const bool anew = control != nullptr && control->node == 0 && nmt::is_reset(control->command) &&
                    line_.state().network == kFatalError;
  const auto* const write = as<line::SdoWrite>(command);
  may_be_slave_ |=
      write != nullptr && write->node == line_.config().node_id && write->address.index == 0x1F80;
  ++commands_;
  if (anew) {
    return;
  }
  if (is_single_output(command)) {
    for (const std::size_t entry : entries_of(command)) {
      writes_[entry].push_back({commands_, number_of(data_of(command))});
    }
  } else if (const auto* const value = as<line::MpdoWrite>(command)) {
    mpdos_.emplace_back(commands_, *value);
  }
  given_[command.tag] = {.command = command,
                         .order = commands_,
                         .time = now,
                         .unconfirmed = is_unconfirmed(command),
                         .refusable = is_refusable(command) || has_fired(command)};
}

void AnswerModel::written(const line::OutputWrite& write) {
  ++commands_;
  zeroes_ |= (write.reactions & line::kZeroOutputs) != 0;
  for (const line::OutputValue& value : write.values) {
    if (value.entry < writes_.size()) {
      writes_[value.entry].push_back(
          {commands_, number_of(std::span(value.data).first(value.length))});
    }
  }
}

// The indices of the outputs that the command writes: of an object, one in each PDO that carries
// it.
std::vector<std::size_t> AnswerModel::entries_of(const line::Command& command) const {
  std::vector<std::size_t> out;
  if (const auto* const output = as<line::SingleOutput>(command)) {
    out.push_back(output->entry);
    return out;
  }
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].node == line::node_of(command) &&
        od::Address{entries[i].index, entries[i].sub} == address_of(command)) {
      out.push_back(i);
    }
  }
  return out;
}

// OwnOutputModel judges those of the own node.
bool AnswerModel::is_single_output(const line::Command& command) const {
  using enum line::CommandKind;
  const line::CommandKind asked = line::kind(command);
  const bool writes = asked == output_write || asked == object_write;
  const auto entries = writes ? entries_of(command) : std::vector<std::size_t>{};
  const auto& places = line_.layout(image::Direction::outputs).entries;
  return !entries.empty() && entries.front() < fields_.size() &&
         places[entries.front()].local_pdo != 0;
}

bool AnswerModel::is_unconfirmed(const line::Command& command) const {
  using enum line::CommandKind;
  const line::CommandKind asked = line::kind(command);
  return asked == nmt || asked == can_send || asked == emcy_send || asked == pdo_trigger ||
         asked == mpdo_write || is_single_output(command);
}

// Uses the state that the line shows before the command. A line that is not NMT master also sends
// outputs to nodes from which it has received nothing.
bool AnswerModel::is_refusable(const line::Command& command) const {
  if (!is_single_output(command)) {
    return false;
  }
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  const line::NodeState said = line_.node_state(entries[entries_of(command).front()].node);
  const bool operational =
      said.presence == line::Presence::present && said.state == nmt::State::operational;
  return !operational && !(may_be_slave_ && said.presence == line::Presence::unknown);
}

// The lines of plants have one group, with all outputs.
bool AnswerModel::has_fired(const line::Command& command) const {
  line::OutputState group;
  line_.output_state(0, group);
  return is_single_output(command) && group.arming_wanted;
}

// --- frames -------------------------------------------------------------------------------------

bool AnswerModel::counts(const Sent& sent, const Given& given) const {
  return sent.after >= given.order && sent.number <= acknowledged_;
}

bool AnswerModel::is_of(const Field& field, const can::Frame& frame) const {
  return field.cob_id.valid() && frame.id == field.cob_id.id() && !frame.remote() &&
         frame.extended() == field.cob_id.extended();
}

bool AnswerModel::is_frame_of(const Given& given, const Sent& sent) const {
  const can::Frame& frame = sent.frame;
  const line::Command& command = given.command;
  using enum line::CommandKind;
  switch (line::kind(command)) {
    case nmt: {
      const auto& control = std::get<line::NmtRequest>(command.request);
      return can::same_content(frame, nmt::encode({control.command, control.node}));
    }
    case can_send:
      return can::same_content(frame, std::get<line::CanSend>(command.request).frame);
    case emcy_send: {
      const auto& emcy = std::get<line::EmcySend>(command.request);
      return frame.id == can::kSyncId + line_.config().node_id && !frame.extended() &&
             is_emcy_of(frame, line_.config().emcy_fd, emcy);
    }
    case lss:
      return is_lss_frame_of(given, frame);
    case mpdo_write:
      return is_mpdo_of(given, frame);
    case pdo_trigger: {
      const auto& trigger = std::get<line::PdoTrigger>(command.request);
      const auto& entries = line_.layout(image::Direction::outputs).entries;
      for (std::size_t i = 0; i < fields_.size(); ++i) {
        if (entries[i].node == trigger.node && fields_[i].pdo == trigger.number &&
            is_of(fields_[i], frame)) {
          return sent.newest;
        }
      }
      return false;
    }
    default:
      return std::ranges::any_of(
          entries_of(command), [&](std::size_t entry) { return is_value_of(given, entry, frame); });
  }
}

bool AnswerModel::has_newest(const can::Frame& frame, Instant now) {
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  bool taken = false;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const Field& field = fields_[i];
    if (!is_of(field, frame)) {
      continue;
    }
    if (!std::exchange(taken, true)) {
      line_.snapshot(image::Direction::outputs, snapshot_, now, true);
    }
    for (unsigned bit = 0; bit < field.bits; ++bit) {
      if (bit_of(snapshot_.bytes, entries[i].bit_offset + bit) !=
          bit_of(frame.data, field.bit + bit)) {
        return false;
      }
    }
  }
  return taken;
}

// Whether the frame carries the value of the command, or a later value of the same entry.
bool AnswerModel::is_value_of(const Given& given, std::size_t entry,
                              const can::Frame& frame) const {
  const Field& field = fields_[entry];
  if (!is_of(field, frame)) {
    return false;
  }
  const std::uint64_t value = carried(frame, field.bit, field.bits);
  return (zeroes_ && value == 0) || std::ranges::any_of(writes_[entry], [&](const Write& write) {
           return write.order >= given.order && !write.refused && write.value == value;
         });
}

// The same for an MPDO.
bool AnswerModel::is_mpdo_of(const Given& given, const can::Frame& frame) const {
  constexpr std::size_t kHead = 4;
  const auto& own = line_.config().forwarding.tpdos;
  const auto& sent = std::get<line::MpdoWrite>(given.command.request);
  const auto head =
      pdo::encode({.mode = pdo::MpdoMode::destination, .node = sent.node, .address = sent.address});
  if (own.empty() || frame.id != own.front().cob_id.id() || frame.remote() ||
      !std::equal(head.begin(), head.begin() + kHead, frame.data.begin())) {
    return false;
  }
  const std::uint64_t value = number_of(std::span(frame.data).subspan(kHead, kHead));
  return std::ranges::any_of(mpdos_, [&](const auto& one) {
    return one.first >= given.order && one.second.node == sent.node &&
           number_of(one.second.data) == value;
  });
}

// Clause 7.
void AnswerModel::check_refused_values(const can::Frame& frame) {
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    if (!is_of(fields_[i], frame)) {
      continue;
    }
    const std::uint64_t value = carried(frame, fields_[i].bit, fields_[i].bits);
    const auto is_it = [value](const Write& write) { return write.value == value; };
    const bool refused = std::ranges::any_of(
        writes_[i], [&](const Write& write) { return is_it(write) && write.refused; });
    const bool taken = std::ranges::any_of(
        writes_[i], [&](const Write& write) { return is_it(write) && !write.refused; });
    if (refused && !taken) {
      early_ = "the value " + std::to_string(value) + " of " +
               line_.layout(image::Direction::outputs).entries[i].name + " was refused and is sent";
    }
  }
}

// --- replies ------------------------------------------------------------------------------------

// An MPDO or a PDO may answer several commands.
std::string AnswerModel::check_sent(const Given& given) {
  const auto it = std::ranges::find_if(sent_, [&](const Sent& sent) {
    return !sent.used && counts(sent, given) && is_frame_of(given, sent);
  });
  if (it == sent_.end()) {
    return "its frame was not acknowledged";
  }
  using enum line::CommandKind;
  const line::CommandKind asked = line::kind(given.command);
  it->used = asked == nmt || asked == can_send || asked == emcy_send || asked == lss;
  return {};
}

// The same for the PDO of one output.
std::string AnswerModel::check_sent(const Given& given, std::size_t entry) {
  const bool sent = std::ranges::any_of(sent_, [&](const Sent& one) {
    return !one.used && counts(one, given) && is_value_of(given, entry, one.frame);
  });
  return sent ? ""
              : "no frame of PDO " + std::to_string(fields_[entry].pdo) +
                    " with the value was acknowledged";
}

std::string AnswerModel::check_output(const Given& given, const line::Reply& reply) {
  const auto* const way = std::get_if<line::WrittenByPdo>(&reply.data);
  if (way == nullptr || !is_single_output(given.command)) {
    return {};
  }
  if (given.refusable) {
    return "its node is not Operational, or the watchdog of its group has fired";
  }
  if (way->wait != line::PdoWait::none) {
    return check_wait(given, *way);
  }
  for (const std::size_t entry : entries_of(given.command)) {
    if (std::string text = check_sent(given, entry); !text.empty()) {
      return text;
    }
  }
  return {};
}

// Clauses 5 and 6.
std::string AnswerModel::check_wait(const Given& given, const line::WrittenByPdo& way) {
  const std::vector<std::size_t> written = entries_of(given.command);
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  const auto named = std::ranges::find_if(
      written, [&](std::size_t entry) { return entries[entry].local_pdo == way.pdo; });
  if (named == written.end()) {
    return "PDO " + std::to_string(way.pdo) + " does not carry the object";
  }
  using enum line::PdoWait;
  switch (way.wait) {
    case values:
      return check_values(given, *named, way);
    case operational:
      return line_.state().own_state == nmt::State::operational
                 ? "it waits for the own node, which is Operational"
                 : "";
    case turn:
      return check_unsent(given, *named, true);
    case bus:
      return check_unsent(given, *named, false);
    default:
      return "nothing that it waits for is configured";
  }
}

std::string AnswerModel::check_values(const Given& given, std::size_t written,
                                      const line::WrittenByPdo& way) {
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  const image::Entry& own = entries[written];
  line_.snapshot(image::Direction::outputs, snapshot_, given.time, true);
  for (const std::uint32_t entry : way.missing) {
    if (entry >= entries.size() || entries[entry].node != own.node ||
        entries[entry].remote_pdo != own.remote_pdo || snapshot_.is_known(entry)) {
      return "it waits for the value of entry " + std::to_string(entry);
    }
  }
  return way.missing.empty() ? "it waits for values and names none" : "";
}

std::string AnswerModel::check_unsent(const Given& given, bool turn, Instant now) {
  if (now != kNever && now < given.time + line::kSendTime) {
    return "it waited for less than its time";
  }
  const bool no_service = turn && line::kind(given.command) == line::CommandKind::can_send;
  for (const Sent& sent : sent_) {
    std::string text = is_frame_of(given, sent) ? check_unsent(given, sent, turn) : std::string();
    if (!text.empty()) {
      return text;
    }
  }
  return no_service ? "a frame of no service waits for no turn" : "";
}

// The same for the PDO of one output.
std::string AnswerModel::check_unsent(const Given& given, std::size_t entry, bool turn) {
  for (const Sent& sent : sent_) {
    std::string text =
        is_value_of(given, entry, sent.frame) ? check_unsent(given, sent, turn) : std::string();
    if (!text.empty()) {
      return text;
    }
  }
  return {};
}

// `sent` is a frame of the command.
std::string AnswerModel::check_unsent(const Given& given, const Sent& sent, bool turn) const {
  const bool since = !sent.used && sent.after >= given.order;
  if (since && !given.lost && sent.number <= acknowledged_) {
    return "its frame was acknowledged";
  }
  return since && turn && sent.number > acknowledged_
             ? "it waits for its turn, and its frame is under way"
             : "";
}

std::string AnswerModel::check_refusal(const Given& given, const line::Reply& reply,
                                       std::span<const Event> events, Instant now) {
  const auto why = static_cast<line::Refusal>(reply.error.code);
  const bool of_lss = line::kind(given.command) == line::CommandKind::lss;
  if (of_lss && reply.error.domain == Domain::command && why == line::Refusal::no_acknowledge) {
    return now < given.time + line::kSendTime ? "it waited for less than its time" : "";
  }
  using enum line::Refusal;
  const bool refused =
      reply.error == line::to_error(cancelled) || reply.error == line::to_error(timed_out);
  if (refused && may_be_carried_out(given)) {
    return "all of its value was sent";
  }
  if (!given.unconfirmed || reply.error.domain != Domain::command) {
    return {};
  }
  if (why == no_acknowledge || why == awaits_turn) {
    return check_unsent(given, why == awaits_turn, now);
  }
  if (!is_single_output(given.command) || why != wrong_state) {
    return {};
  }
  const std::vector<std::size_t> entries = entries_of(given.command);
  for (const std::size_t entry : entries) {
    for (Write& write : writes_[entry]) {
      write.refused |= now == given.time && write.order == given.order;
    }
  }
  const std::uint8_t node = line_.layout(image::Direction::outputs).entries[entries.front()].node;
  return check_event(
      {.node = node, .refusal = why, .command = line::kind(given.command), .time = now}, events);
}

// Clause 8. The line has one place for each of kPlaces different events and a shared place, and an
// event is suppressed only if an event passed in its place less than a second before. So without an
// equal event, one event passed in each place: kPlaces different ones, and the one of the shared
// place. In that case no event may have the node-ID of the refusal: the next event in the shared
// place has the node-ID of the last refusal and the number of the others.
std::string AnswerModel::check_event(const Held& refusal, std::span<const Event> events) {
  const bool has_own = std::ranges::any_of(events, [&](const Event& event) {
    return refusal.is_of(event) && event.time == refusal.time;
  });
  if (has_own) {
    return {};
  }
  held_.push_back(refusal);
  std::set<std::tuple<std::uint8_t, line::Refusal, line::CommandKind>> different;
  std::size_t passed = 0;
  for (const Event& event : events) {
    const auto* const refused = event.get<event::CommandRefused>();
    if (refused == nullptr || event.time + RepeatLimit::kInterval <= refusal.time) {
      continue;
    }
    if (refusal.is_of(event)) {
      return {};
    }
    different.insert({event.node, refused->refusal, refused->command});
    ++passed;
  }
  const bool full = different.size() >= RepeatLimit::kPlaces && passed > RepeatLimit::kPlaces;
  return full ? std::string() : "no event names its node";
}

// Removes the refusals that the new events name or count. The number in an event counts equal
// refusals, or different ones that shared a place; the event does not distinguish them.
void AnswerModel::count_held(std::span<const Event> events) {
  for (const Event& event : events.subspan(std::exchange(counted_, events.size()))) {
    const auto* const refused = event.get<event::CommandRefused>();
    const bool counts = refused != nullptr && refused->suppressed != 0;
    std::erase_if(held_, [&](const Held& refusal) {
      return refusal.time <= event.time && (counts || refusal.is_of(event));
    });
  }
}

std::string AnswerModel::compare(std::span<const Event> events, Instant now) {
  count_held(events);
  if (!held_.empty() && now > held_.front().time + RepeatLimit::kInterval) {
    return "a refusal of node " + std::to_string(held_.front().node) +
           " was held back, and no event counts it";
  }
  for (const auto& [tag, given] : given_) {
    const bool late = given.unconfirmed && now > given.time + line::kSendTime + kAnswerGrace;
    if (late || (given.refusable && now > given.time)) {
      return "command " + std::to_string(tag) + " (" +
             std::string(line::name(line::kind(given.command))) + ") is not answered" +
             (late ? " in time" : " at once: it must be refused");
    }
  }
  return early_;
}

}  // namespace linegate::plant
