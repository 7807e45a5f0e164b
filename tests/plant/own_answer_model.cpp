// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/own_answer_model.h"

#include <algorithm>
#include <tuple>

#include "stack/base/byte_order.h"
#include "stack/nmt/node_control.h"
#include "stack/pdo/parameters.h"

#include "tests/plant/output_fields.h"
#include "tests/plant/request_fields.h"

namespace linegate::plant {
namespace {

constexpr Duration kOwnAnswerGrace = std::chrono::milliseconds(1);

std::uint64_t value_of(const line::Command& command) {
  const auto data = data_of(command);
  return bits_of(data, 0, static_cast<unsigned>(data.size() * 8));
}

}  // namespace

OwnAnswerModel::OwnAnswerModel(line::Line& line) : line_(line) {
  const image::Layout& layout = line.layout(image::Direction::outputs);
  fields_.resize(layout.entries.size());
  writes_.resize(layout.entries.size());
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    fields_[i].node = layout.entries[i].node;
    fields_[i].bits = layout.entries[i].bit_length;
  }
  for (const line::DeviceConfig& device : line.config().devices) {
    const Loaded<pdo::DevicePdos> described = pdos_in(device.device, line.config().canopen_fd);
    for (const pdo::Parameters& tpdo : described.value->tpdos) {
      transmissions_.push_back(
          {.node = device.id, .pdo = tpdo.number, .cob_id = tpdo.cob_id, .type = tpdo.type});
      each_output(layout, device.id, tpdo, [&](std::size_t i, od::Address, unsigned bit) {
        fields_[i].pdo = tpdo.number;
        fields_[i].cob_id = tpdo.cob_id;
        fields_[i].bit = bit;
      });
    }
  }
}

void OwnAnswerModel::commanded(const line::Command& command, Instant now) {
  ++commands_;
  if (const std::size_t entry = entry_of(command); entry < writes_.size()) {
    writes_[entry].push_back({commands_, value_of(command)});
  }
  given_[command.tag] = {.command = command, .order = commands_, .time = now};
}

// The index of the output that the command writes; fields_.size() if it writes none.
std::size_t OwnAnswerModel::entry_of(const line::Command& command) const {
  if (const auto* const output = as<line::SingleOutput>(command)) {
    return output->entry;
  }
  const auto* const write = as<line::LocalWrite>(command);
  if (write == nullptr) {
    return fields_.size();
  }
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  const auto it = std::ranges::find_if(entries, [&](const image::Entry& entry) {
    return entry.node == write->node && od::Address{entry.index, entry.sub} == write->address;
  });
  return static_cast<std::size_t>(it - entries.begin());
}

// --- frames -------------------------------------------------------------------------------------

void OwnAnswerModel::before_receive(const can::Frame& frame) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  if (!control || control->command == nmt::Command::start) {
    return;
  }
  for (const line::DeviceConfig& device : line_.config().devices) {
    if (control->addresses(device.id)) {
      started_after_[device.id] = submitted_;
    }
  }
  for (auto& [tag, given] : given_) {
    given.reset |= nmt::is_reset(control->command) && control->addresses(node_of(given.command));
  }
}

void OwnAnswerModel::submitted(const can::Frame& frame, Instant now) {
  ++submitted_;
  for (Transmission& tpdo : transmissions_) {
    if (frame.id == tpdo.cob_id.id() && !frame.extended() && !frame.remote()) {
      tpdo.under_way.emplace_back(submitted_, frame);
    }
  }
  if (!given_.empty()) {
    sent_.push_back({.frame = frame,
                     .number = submitted_,
                     .after = commands_,
                     .newest = has_newest(frame, now)});
  }
}

void OwnAnswerModel::acknowledged(std::uint64_t number) {
  acknowledged_ = number;
  for (Transmission& tpdo : transmissions_) {
    for (; !tpdo.under_way.empty() && tpdo.under_way.front().first <= number;
         tpdo.under_way.pop_front()) {
      std::tie(tpdo.number, tpdo.newest) = tpdo.under_way.front();
    }
  }
}

void OwnAnswerModel::lost(std::uint64_t first, std::uint64_t last) {
  const auto is_lost = [first, last](std::uint64_t number) {
    return number >= first && number <= last;
  };
  for (Transmission& tpdo : transmissions_) {
    std::erase_if(tpdo.under_way, [&](const auto& frame) { return is_lost(frame.first); });
  }
  std::erase_if(sent_, [&](const Sent& sent) { return is_lost(sent.number); });
}

void OwnAnswerModel::set_bus(bool on) {
  is_off_bus_ = !on;
  if (!on) {
    started_after_.fill(submitted_);
  }
}

std::uint8_t OwnAnswerModel::node_of(const line::Command& command) const {
  const auto* const output = as<line::SingleOutput>(command);
  return output != nullptr ? fields_[output->entry].node : line::node_of(command);
}

bool OwnAnswerModel::has_newest(const can::Frame& frame, Instant now) {
  bool taken = false;
  const auto& entries = line_.layout(image::Direction::outputs).entries;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const Field& field = fields_[i];
    if (field.pdo == 0 || frame.remote() || frame.extended() || frame.id != field.cob_id.id()) {
      continue;
    }
    if (!taken) {
      line_.snapshot(image::Direction::outputs, snapshot_, now, true);
      taken = true;
    }
    const std::uint64_t shown = bits_of(snapshot_.bytes, entries[i].bit_offset, field.bits);
    if (bits_of(frame.data, field.bit, field.bits) != shown) {
      return false;
    }
  }
  return taken;
}

bool OwnAnswerModel::is_frame_of(const Given& given, const Sent& sent) const {
  const line::Command& command = given.command;
  const can::Frame& frame = sent.frame;
  if (sent.after < given.order || sent.used || frame.extended() || frame.remote()) {
    return false;
  }
  if (const auto* const emcy = as<line::EmcySend>(command)) {
    return frame.id == can::kSyncId + emcy->node &&
           is_emcy_of(frame, line_.config().emcy_fd, *emcy);
  }
  if (const auto* const trigger = as<line::PdoTrigger>(command)) {
    return sent.newest && std::ranges::any_of(fields_, [&](const Field& field) {
             return field.node == trigger->node && field.pdo == trigger->number &&
                    field.cob_id.id() == frame.id;
           });
  }
  const std::uint32_t entry = std::get<line::SingleOutput>(command.request).entry;
  const Field& field = fields_[entry];
  const std::uint64_t value = bits_of(frame.data, field.bit, field.bits);
  return field.pdo != 0 && frame.id == field.cob_id.id() &&
         std::ranges::any_of(writes_[entry], [&](const Write& write) {
           return write.order >= given.order && write.value == value;
         });
}

bool OwnAnswerModel::is_sent(const Given& given) {
  const auto it = std::ranges::find_if(sent_, [&](const Sent& sent) {
    return sent.number <= acknowledged_ && is_frame_of(given, sent);
  });
  if (it == sent_.end()) {
    return false;
  }
  it->used = line::kind(given.command) == line::CommandKind::emcy_send;
  return true;
}

// --- replies ------------------------------------------------------------------------------------

std::string OwnAnswerModel::answered(const line::Reply& reply, Instant now) {
  const auto found = given_.find(reply.tag);
  if (found == given_.end()) {
    return "a command that was not given, or answered before, is answered";
  }
  const Given given = found->second;
  given_.erase(found);
  const std::string text = check(given, reply, now);
  if (given_.empty()) {
    sent_.clear();
  }
  return text.empty() ? text
                      : std::string(line::name(line::kind(given.command))) + " of node " +
                            std::to_string(node_of(given.command)) + " is answered as " +
                            (reply.ok() ? "done: " : "not done: ") + text;
}

std::string OwnAnswerModel::check(const Given& given, const line::Reply& reply, Instant now) {
  if (!reply.ok()) {
    return reply.error.domain == Domain::command
               ? check_refusal(given, static_cast<line::Refusal>(reply.error.code), now)
               : "aborted";
  }
  switch (line::kind(given.command)) {
    case line::CommandKind::output_write:
      return check_value(given, reply, now);
    case line::CommandKind::local_write:
      return check_written(given, now);
    default:
      return is_sent(given) ? std::string() : "its frame was not acknowledged";
  }
}

std::string OwnAnswerModel::check_value(const Given& given, const line::Reply& reply, Instant now) {
  if (fields_[entry_of(given.command)].pdo == 0) {
    return reply.data == line::ReplyData{} ? std::string() : "no TPDO carries it";
  }
  const auto* const way = std::get_if<line::WrittenByPdo>(&reply.data);
  if (way == nullptr) {
    return "it names no TPDO";
  }
  switch (way->wait) {
    case line::PdoWait::none:
      return is_sent(given) ? std::string()
                            : "no frame of its TPDO with the value was acknowledged";
    case line::PdoWait::operational:
      return check_state(given);
    case line::PdoWait::turn:
      return check_unsent(given, true, now);
    case line::PdoWait::bus:
      return check_unsent(given, false, now);
    default:
      return "nothing that it waits for is configured";
  }
}

std::string OwnAnswerModel::check_written(const Given& given, Instant now) {
  const std::size_t place = entry_of(given.command);
  if (place >= fields_.size()) {
    return "the image has no such entry";
  }
  const image::Entry& entry = line_.layout(image::Direction::outputs).entries[place];
  line_.snapshot(image::Direction::outputs, snapshot_, now, true);
  const std::uint64_t shown = bits_of(snapshot_.bytes, entry.bit_offset, entry.bit_length);
  return shown == value_of(given.command) ? std::string() : "the image has another value";
}

std::string OwnAnswerModel::check_refusal(const Given& given, line::Refusal why, Instant now) {
  using enum line::CommandKind;
  const bool waits =
      line::kind(given.command) == emcy_send || line::kind(given.command) == pdo_trigger;
  if (waits && why == line::Refusal::wrong_state) {
    return check_state(given);
  }
  if (waits && why == line::Refusal::no_acknowledge) {
    return check_unsent(given, false, now);
  }
  if (line::kind(given.command) == pdo_trigger && why == line::Refusal::awaits_turn) {
    return check_unsent(given, true, now);
  }
  return std::string(line::describe(why));
}

std::string OwnAnswerModel::check_state(const Given& given) const {
  const nmt::State state = line_.node_state(node_of(given.command)).state;
  const bool is_able = line::kind(given.command) == line::CommandKind::emcy_send
                           ? state != nmt::State::stopped && state != nmt::State::initialising
                           : state == nmt::State::operational;
  return is_able && !given.reset ? "its device is " + std::string(nmt::name(state)) : std::string();
}

std::string OwnAnswerModel::check_unsent(const Given& given, bool turn, Instant now) const {
  if (now < given.time + line::kSendTime) {
    return "it waited for less than its time";
  }
  for (const Sent& sent : sent_) {
    const bool counts = sent.newest || line::kind(given.command) == line::CommandKind::emcy_send;
    if (!counts || !is_frame_of(given, sent)) {
      continue;
    }
    if (sent.number <= acknowledged_) {
      return "its frame was acknowledged";
    }
    if (turn) {
      return "it waits for its turn, and its frame is under way";
    }
  }
  return {};
}

std::string OwnAnswerModel::compare(Instant now) {
  std::string text = compare_commands(now);
  return text.empty() ? compare_outputs(now) : text;
}

// --- outputs ------------------------------------------------------------------------------------

std::string OwnAnswerModel::compare_outputs(Instant now) {
  for (const line::DeviceConfig& device : line_.config().devices) {
    if (line_.node_state(device.id).state != nmt::State::operational) {
      started_after_[device.id] = submitted_;
    }
  }
  line_.snapshot(image::Direction::outputs, snapshot_, now, true);
  for (std::size_t entry = 0; entry < fields_.size(); ++entry) {
    if (std::string text = check_valid(entry); !text.empty()) {
      return "the output " + line_.layout(image::Direction::outputs).entries[entry].name +
             " is valid, and " + text;
    }
  }
  return check_waits();
}

// An entry of no TPDO is valid when it is known. A device with another node-ID, of LSS, has other
// COB-IDs.
std::string OwnAnswerModel::check_valid(std::size_t entry) const {
  const Field& field = fields_[entry];
  if (!snapshot_.is_valid(entry)) {
    return {};
  }
  if (!snapshot_.is_known(entry)) {
    return "it was never written";
  }
  const nmt::State state = line_.node_state(field.node).state;
  if (state != nmt::State::operational) {
    return "its device is " + std::string(nmt::name(state));
  }
  if (is_off_bus_) {
    return "its line is off the bus";
  }
  const auto tpdo = std::ranges::find_if(transmissions_, [&](const Transmission& each) {
    return each.node == field.node && each.pdo == field.pdo;
  });
  const bool has_id = line_.own_device(field.node)->node_id == field.node;
  if (tpdo == transmissions_.end() || !tpdo->cob_id.valid() || !has_id) {
    return {};
  }
  if (tpdo->number <= started_after_[field.node]) {
    return "no frame of its TPDO was acknowledged since the start of its device";
  }
  const std::uint32_t place = line_.layout(image::Direction::outputs).entries[entry].bit_offset;
  const bool is_same = bits_of(tpdo->newest.data, field.bit, field.bits) ==
                       bits_of(snapshot_.bytes, place, field.bits);
  return is_same ? std::string() : "the newest frame of its TPDO has another value";
}

std::string OwnAnswerModel::check_rest(Instant now) {
  line_.snapshot(image::Direction::outputs, snapshot_, now, true);
  for (std::size_t entry = 0; entry < fields_.size(); ++entry) {
    const Field& field = fields_[entry];
    const bool waits = std::ranges::any_of(transmissions_, [&](const Transmission& each) {
      return each.node == field.node && each.pdo == field.pdo && !pdo::is_event_driven(each.type);
    });
    const bool operational = line_.node_state(field.node).state == nmt::State::operational;
    if (!waits && operational && snapshot_.is_known(entry) && !snapshot_.is_valid(entry)) {
      return "the output " + line_.layout(image::Direction::outputs).entries[entry].name +
             " is not valid at rest";
    }
  }
  return {};
}

bool OwnAnswerModel::holds(const line::OutputState::Wait& wait) const {
  using enum line::OutputWait;
  if (!snapshot_.is_known(wait.entry) || wait.reason == value) {
    return wait.reason == value && !snapshot_.is_known(wait.entry);
  }
  const bool operational =
      line_.node_state(fields_[wait.entry].node).state == nmt::State::operational;
  if (!operational || wait.reason == own_node) {
    return wait.reason == own_node && !operational;
  }
  return is_off_bus_ ? wait.reason == bus : wait.reason != bus || acknowledged_ < submitted_;
}

std::string OwnAnswerModel::check_waits() const {
  for (std::size_t group = 0; group < line_.output_groups(); ++group) {
    line::OutputState state;
    line_.output_state(group, state);
    for (const line::OutputState::Wait& wait : state.waits) {
      if (snapshot_.is_valid(wait.entry)) {
        return "a valid output waits";
      }
      if (!holds(wait)) {
        return "an output waits for another reason than " +
               std::to_string(static_cast<unsigned>(wait.reason));
      }
    }
    std::size_t invalid = 0;
    for (std::size_t entry = 0; entry < fields_.size(); ++entry) {
      invalid += snapshot_.is_valid(entry) ? 0U : 1U;
    }
    if (line_.output_groups() == 1 && state.waiting != invalid) {
      return "OutputState does not count all outputs that wait";
    }
  }
  return {};
}

// --- commands -----------------------------------------------------------------------------------

std::string OwnAnswerModel::compare_commands(Instant now) const {
  for (const auto& [tag, given] : given_) {
    if (now > given.time + line::kSendTime + kOwnAnswerGrace) {
      return std::string(line::name(line::kind(given.command))) + " of node " +
             std::to_string(node_of(given.command)) + " is not answered in time";
    }
  }
  return {};
}

}  // namespace linegate::plant
