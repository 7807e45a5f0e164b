// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <utility>

#include "bridges/client/core.h"
#include "bridges/client/values.h"

namespace linegate::client {
namespace {

constexpr linegate::Duration kLongestPause = std::chrono::milliseconds(200);
constexpr linegate::Duration kShortestPause = std::chrono::milliseconds(1);
constexpr std::size_t kMostOutputs = 4096;  // of an OutputWrite
constexpr std::string_view kOutputsPrefix = "outputs:";

linegate::Duration pause_of(const GroupOptions& options) {
  if (options.watchdog <= linegate::Duration::zero())
    return kLongestPause;
  return std::clamp<linegate::Duration>(options.watchdog / 4, kShortestPause, kLongestPause);
}

bool is_written(const GroupData& group) {
  return group.state == GroupState::taking || group.state == GroupState::held;
}

Error error_of(LineStatus status) {
  if (status == LineStatus::ambiguous)
    return Error::ambiguous;
  return status == LineStatus::ready ? Error::none : Error::not_ready;
}

// The values of the group belong to this layout, with these names, and this start of the gateway.
bool is_bound(const GroupData& group, const LineData& line) {
  return group.layout_id == line.area(image::Direction::outputs).layout->id &&
         group.outputs_revision == line.outputs_revision && group.incarnation == line.incarnation;
}

std::string_view describe_wait(line::OutputWait wait) {
  switch (wait) {
    case line::OutputWait::value:
      return "never written, and without a default";
    case line::OutputWait::values:
      return "another output of its PDO was never written and has no default";
    case line::OutputWait::own_node:
      return "the gateway's own node is not Operational";
    case line::OutputWait::node:
      return "its node is not confirmed as Operational, or has other PDOs than the image";
    case line::OutputWait::turn:
      return "waits for SYNC, an inhibit time or the bus";
    case line::OutputWait::bus:
      return "the bus does not acknowledge frames";
    case line::OutputWait::trigger:
      return "waits for a trigger of its PDO";
    case line::OutputWait::update_time:
      return "its PDO collects values";
  }
  return "unknown";
}

}  // namespace

Error Core::ready_line(const GroupData& group, const LineData*& line) const {
  if (!link)
    return Error::closed;
  const Error unusable = error_of(status(group.gateway, group.line));
  line = unusable == Error::none ? find(group.gateway, group.line).line : nullptr;
  return unusable;
}

// Discards the values of another layout, or of another start of the gateway.
void Core::bind(GroupData& group, const LineData& line) {
  if (is_bound(group, line))
    return;
  group.values.clear();
  group.layout_id = line.area(image::Direction::outputs).layout->id;
  group.outputs_revision = line.outputs_revision;
  group.incarnation = line.incarnation;
}

Error Core::set(GroupData& group, std::string_view output, const Data& value, bool raw) {
  const LineData* ready = nullptr;
  if (const Error unusable = ready_line(group, ready); unusable != Error::none)
    return unusable;
  const LineData& line = *ready;
  if (output.starts_with(kOutputsPrefix))
    output.remove_prefix(kOutputsPrefix.size());
  const Area& area = line.area(image::Direction::outputs);
  const auto found = area.entries.find(std::string(output));
  if (found == area.entries.end())
    return Error::no_name;
  const image::Entry& entry = area.layout->entries[found->second];
  std::vector<std::byte> bytes;
  const Error failed =
      raw ? encode(value, entry.type, entry.bit_length, bytes) : encode_scaled(value, entry, bytes);
  if (failed != Error::none)
    return failed;
  line::OutputValue out{.entry = found->second};
  if (bytes.size() > out.data.size())
    return Error::wrong_type;
  // The loss is not reported yet: the value must not be mixed with others.
  if (is_written(group) && !is_bound(group, line))
    return Error::not_ready;
  bind(group, line);
  if (group.values.size() >= kMostOutputs && !group.values.contains(out.entry))
    return Error::too_long;
  out.length = static_cast<std::uint8_t>(bytes.size());
  std::ranges::copy(bytes, out.data.begin());
  group.values[out.entry] = out;
  group.dirty = true;
  return Error::none;
}

Error Core::set(GroupData& group, std::span<const Setting> settings, std::size_t& failed) {
  const GroupData before = group;
  for (failed = 0; failed < settings.size(); ++failed) {
    const Setting& one = settings[failed];
    if (const Error why = set(group, one.name, one.value, one.raw); why != Error::none) {
      group = before;
      return why;
    }
  }
  return Error::none;
}

const LineData::Group* Core::state_of(const GroupData& group) const {
  const Model::Found found = find(group.gateway, group.line);
  if (found.line == nullptr || found.ambiguous)
    return nullptr;
  const auto number = group_number(*found.line, group.name);
  const auto state = number ? found.line->groups.find(*number) : found.line->groups.end();
  const bool known = state != found.line->groups.end() && found.line->is_present(&state->second);
  return known ? &state->second : nullptr;
}

Error Core::arm(GroupData& group) {
  const LineData* ready = nullptr;
  if (const Error unusable = ready_line(group, ready); unusable != Error::none)
    return unusable;
  const LineData& line = *ready;
  const auto number = group_number(line, group.name);
  const LineData::Group* const state = state_of(group);
  const bool states_received = link->now() - line.begun >= kSilence;
  if (!number || (state == nullptr && states_received))
    return states_received ? Error::no_name : Error::not_ready;
  bind(group, line);
  group.number = *number;
  group.refused_before = state == nullptr ? std::nullopt : std::optional(state->state.refused);
  // Never that of another client, nor an earlier one of this client.
  last_arming = std::max(last_arming + 1, static_cast<std::uint64_t>(link->utc()));
  group.arming = last_arming;
  group.write_at = link->now();
  group.refusal = line::OutputRefusal::none;
  set_state(group, GroupState::taking, LossReason::none);
  write(group, line);
  return Error::none;
}

void Core::release(GroupData& group) {
  group.values.clear();
  set_state(group, GroupState::idle, LossReason::none);
}

void Core::set_state(GroupData& group, GroupState state, LossReason reason) {
  if (group.state == state && group.reason == reason)
    return;
  group.state = state;
  group.reason = reason;
  for (const auto& one : live(group.subscriptions)) {
    due.emplace_back([weak = std::weak_ptr(one)] {
      if (const auto subscription = lock(weak))
        subscription->on_group({});
    });
  }
}

void Core::lose(GroupData& group, LossReason reason) {
  group.values.clear();
  set_state(group, GroupState::lost, reason);
}

void Core::service_groups() {
  std::erase_if(groups, [](const auto& one) { return one.expired(); });
  for (const auto& weak : std::vector(groups)) {
    const auto group = weak.lock();
    if (group && is_written(*group))
      service_group(group);
  }
}

void Core::service_group(const std::shared_ptr<GroupData>& group) {
  const Model::Found found = find(group->gateway, group->line);
  if (found.ambiguous)
    return lose(*group, LossReason::ambiguous);
  const LineStatus status =
      found.line == nullptr ? LineStatus::lost : found.line->status(link->now());
  if (status == LineStatus::lost)
    return lose(*group, LossReason::gateway_lost);
  if (status == LineStatus::silent)
    return lose(*group, LossReason::gateway_silent);
  if (status == LineStatus::ambiguous)
    return lose(*group, LossReason::ambiguous);
  if (found.line->incarnation != group->incarnation)
    return lose(*group, LossReason::restarted);
  const Area& area = found.line->area(image::Direction::outputs);
  if (!area.layout || !is_bound(*group, *found.line) ||
      group_number(*found.line, group->name) != group->number)
    return lose(*group, LossReason::layout_changed);
  const LineData::Group* const state = state_of(*group);
  if (state != nullptr)
    judge(*group, *state);
  else if ((group->state == GroupState::held && !found.line->groups.contains(group->number)) ||
           link->now() - found.line->begun >= kSilence)
    return lose(*group, LossReason::no_group);
  if (is_written(*group) && (group->dirty || link->now() >= group->write_at))
    write(*group, *found.line);
}

void Core::judge(GroupData& group, const LineData::Group& state) {
  const line::OutputState& now = state.state;
  const bool mine = now.owner == name && now.arming == group.arming;
  // A refused write is repeated, so a refusal before the first state is counted again after it.
  const std::uint64_t before = group.refused_before.value_or(now.refused);
  group.refused_before = before;
  if (now.refusal != line::OutputRefusal::none && now.refused_client == name &&
      now.refused != before) {
    group.refusal = now.refusal;
    group.values.clear();
    return set_state(group, GroupState::refused, LossReason::none);
  }
  if (mine && now.arming_wanted)
    return lose(group, LossReason::watchdog);
  if (mine)
    return set_state(group, GroupState::held, LossReason::none);
  if (group.state == GroupState::held)
    lose(group, LossReason::other_owner);
}

void Core::write(GroupData& group, const LineData& line) {
  line::OutputWrite out;
  out.group = group.number;
  out.layout_id = group.layout_id;
  out.arming = group.arming;
  out.watchdog = std::max(group.options.watchdog, linegate::Duration::zero());
  out.reactions = group.options.reactions;
  for (const auto& [entry, value] : group.values)
    out.values.push_back(value);
  // If DDS does not accept it, it is repeated as any other.
  (void)link->write_outputs({line.gateway, line.line, group.incarnation}, out);
  group.dirty = false;
  group.write_at = link->now() + pause_of(group.options);
}

// --- the handle ----------------------------------------------------------------------------------

Group Core::group_of(std::shared_ptr<Core> core, std::shared_ptr<GroupData> data) {
  Group out;
  out.core_ = std::move(core);
  out.data_ = std::move(data);
  return out;
}

Error Group::set(std::string_view name, const Data& value) {
  return data_ ? core_->set(*data_, name, value, false) : Error::bad_argument;
}

Error Group::set_raw(std::string_view name, const Data& value) {
  return data_ ? core_->set(*data_, name, value, true) : Error::bad_argument;
}

Error Group::set(std::span<const Setting> settings, std::size_t* failed) {
  std::size_t place = 0;
  const Error error = data_ ? core_->set(*data_, settings, place) : Error::bad_argument;
  if (failed != nullptr && error != Error::none)
    *failed = place;
  return error;
}

Error Group::arm() {
  return data_ ? core_->arm(*data_) : Error::bad_argument;
}

void Group::release() {
  if (data_)
    core_->release(*data_);
}

GroupState Group::state() const {
  return data_ ? data_->state : GroupState::idle;
}

bool Group::lost() const {
  return state() == GroupState::lost || state() == GroupState::refused;
}

LossReason Group::reason() const {
  return data_ ? data_->reason : LossReason::none;
}

std::string Group::text() const {
  if (state() == GroupState::lost)
    return std::string(describe(state())) + ": " + std::string(describe(reason()));
  if (state() == GroupState::refused)
    return std::string(describe(state())) + ": " + std::string(line::describe(data_->refusal));
  const std::string other = state() == GroupState::taking ? owner() : "";
  return std::string(describe(state())) +
         (other.empty() || other == core_->name ? "" : "; its last values are of " + other);
}

std::string Group::owner() const {
  const LineData::Group* const state = data_ ? core_->state_of(*data_) : nullptr;
  return state == nullptr ? "" : state->state.owner;
}

std::vector<std::pair<std::string, std::string>> Group::waiting() const {
  std::vector<std::pair<std::string, std::string>> out;
  const LineData::Group* const state = data_ ? core_->state_of(*data_) : nullptr;
  if (state == nullptr)
    return out;
  const Area& area = core_->find(data_->gateway, data_->line).line->area(image::Direction::outputs);
  for (const line::OutputState::Wait& wait : state->state.waits) {
    if (area.layout && wait.entry < area.layout->entries.size())
      out.emplace_back(area.layout->entries[wait.entry].name, describe_wait(wait.reason));
  }
  return out;
}

Subscription Group::on_state(std::function<void(const Group&)> call_back) {
  if (!data_ || !call_back)
    return {};
  SubscriptionData data;
  // Weak: the call-back shall not hold the group.
  data.on_group = [core = std::weak_ptr(core_), weak = std::weak_ptr(data_),
                   call_back = std::move(call_back)](const Group& /*none*/) {
    auto group = weak.lock();
    auto owner = core.lock();
    if (group && owner)
      call_back(Core::group_of(std::move(owner), std::move(group)));
  };
  auto shared = std::make_shared<SubscriptionData>(std::move(data));
  data_->subscriptions.push_back(shared);
  return Core::handle(std::move(shared));
}

std::string_view describe(GroupState state) {
  switch (state) {
    case GroupState::idle:
      return "not armed";
    case GroupState::taking:
      return "written, not applied yet";
    case GroupState::held:
      return "held";
    case GroupState::refused:
      return "refused";
    case GroupState::lost:
      return "lost";
  }
  return "unknown";
}

std::string_view describe(LossReason reason) {
  switch (reason) {
    case LossReason::none:
      return "no reason";
    case LossReason::other_owner:
      return "another client writes the group";
    case LossReason::watchdog:
      return "its watchdog has fired, or another NMT master was active";
    case LossReason::restarted:
      return "the gateway was restarted";
    case LossReason::layout_changed:
      return "the layout of the outputs has changed";
    case LossReason::gateway_silent:
      return "the gateway is silent";
    case LossReason::gateway_lost:
      return "the gateway is lost";
    case LossReason::ambiguous:
      return "several gateways have a line of that name";
    case LossReason::no_group:
      return "the line has no such group";
  }
  return "unknown";
}

}  // namespace linegate::client
