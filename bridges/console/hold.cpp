// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/hold.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <ostream>
#include <utility>

#include "bridges/console/lookup.h"
#include "bridges/console/output_groups.h"
#include "bridges/console/output_text.h"
#include "bridges/console/table.h"
#include "bridges/console/value_text.h"

namespace linegate::console {
namespace {

constexpr Duration kWriteAgain = std::chrono::milliseconds(200);

bool is_part_of_name(char letter) {
  return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '/' || letter == '-' ||
         letter == '_' || letter == '.';
}

// Whether the text of an event has the name of a client: of "hmi/1/1", but not of "hmi/1/12".
bool names_client(const std::string& text, const std::string& name) {
  for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || !is_part_of_name(text[at - 1])) &&
        (end == text.size() || !is_part_of_name(text[end]))) {
      return true;
    }
  }
  return false;
}

class Holder {
 public:
  Holder(Context& context, const HoldRequest& request, Model& model, const Line& line)
      : context_(context), request_(request), model_(model), line_(line) {}

  // Returns kDone, or the exit code for an invalid entry or value.
  int prepare() {
    if (!wait_until(context_, model_, [&] { return outputs().layout.has_value(); })) {
      context_.err << "the output layout of " << printable(line_.id.line) << " was not received\n";
      return kFailed;
    }
    const image::Layout& layout = *outputs().layout;
    const auto entry = find_entry(context_, layout, request_.entry);
    if (!entry) {
      return kUsage;
    }
    const image::Entry& place = layout.entries[*entry];
    TypedValue typed = typed_value(place, request_.value, request_.raw);
    if (!typed.error.empty() || typed.data.size() > value_.data.size()) {
      context_.err << (typed.error.empty() ? "'" + printable(request_.value) + "' is longer than " +
                                                 std::to_string(value_.data.size()) + " bytes"
                                           : typed.error)
                   << '\n';
      return kUsage;
    }
    if (!set_group(place, *entry)) {
      return kUsage;
    }
    value_ = {.entry = *entry, .length = static_cast<std::uint8_t>(typed.data.size()), .data = {}};
    std::ranges::copy(typed.data, value_.data.begin());
    wanted_ = std::move(typed.data);
    layout_id_ = layout.id;
    name_ = place.name;
    incarnation_ = line_.view->incarnation;
    seen_ = model_.events_seen();
    events_before_ = line_.view->state.counters.events;
    arming_ = static_cast<std::uint64_t>(utc_now().time_since_epoch().count());
    client_ = context_.client.name();
    if (const auto known = line_.groups.find(group_); known != line_.groups.end()) {
      refused_before_ = known->second.state.refused;
    }
    return kDone;
  }

  int run(const std::function<bool()>& stopped) {
    const Instant begin = steady_now();
    Instant again = begin;
    while (!stopped() &&
           (request_.time <= Duration::zero() || steady_now() - begin < request_.time)) {
      if (steady_now() >= again) {
        again = steady_now() + kWriteAgain;
        is_published_ = write();
      }
      poll(context_, model_, kWriteAgain / 4);
      if (const std::string why = why_it_ends(); !why.empty()) {
        context_.err << why << '\n';
        return kFailed;
      }
      look();
      if (!was_held_ && steady_now() - begin >= context_.timeout) {
        break;
      }
    }
    return result();
  }

 private:
  const Area& outputs() const {
    return line_.areas[static_cast<std::size_t>(image::Direction::outputs)];
  }

  // Uses the given group, or the group of the entry; otherwise reports the reason on context.err.
  bool set_group(const image::Entry& place, std::uint32_t number) {
    entry_group_ = group_of_entry(*line_.view, number);
    group_ = request_.group.value_or(entry_group_.number);
    if (request_.group || entry_group_.found == EntryGroup::Found::group) {
      return true;
    }
    context_.err << printable(place.name)
                 << (entry_group_.found == EntryGroup::Found::none
                         ? " is in no group of outputs: add it to one in plant.yaml, or write it "
                           "without --hold and --while"
                         : ": its group of outputs is not known, give it with --group:");
    for (const std::string& one : group_texts(line_)) {
      context_.err << "\n  " << one;
    }
    context_.err << '\n';
    return false;
  }

  // Appended to the refusal of a given group that does not contain the entry.
  std::string group_hint() const {
    return entry_group_.found == EntryGroup::Found::group && entry_group_.number != group_
               ? "; the output is in group " + std::to_string(entry_group_.number) + ": --group " +
                     std::to_string(entry_group_.number) + ", or no --group"
               : "";
  }

  // For this incarnation alone: after a restart of the gateway the application decides again.
  bool write() {
    line::OutputWrite out;
    out.group = group_;
    out.layout_id = layout_id_;
    out.arming = arming_;
    out.watchdog = kHoldWatchdog;
    out.reactions = line::kZeroOutputs;
    out.values.push_back(value_);
    return context_.client.write_outputs(line_.id, incarnation_, out);
  }

  // Reports it when the value is held, and when it is not held any more.
  void look() {
    const bool held = is_sent();
    if (std::exchange(is_held_, held) == held) {
      return;
    }
    if (!held) {
      was_lost_ = true;
      context_.err << "not held any more: " << why_not() << '\n';
    } else if (std::exchange(was_held_, true)) {
      context_.err << "held again\n";
    } else {
      context_.err << "held; the outputs of group " << group_ << " become 0 "
                   << kHoldWatchdog / std::chrono::seconds(1) << " s after the end\n";
    }
  }

  // At the end. An output that was held up to the end, but not all the time, has failed, too.
  int result() const {
    const bool waits = !is_held_ && is_applied() && outputs().value(value_.entry) == wanted_;
    if (waits) {
      context_.err << name_text()
                   << " was written, and not sent: " << output_state(line_, value_.entry) << '\n';
    } else if (!was_held_) {
      context_.err << "the image of " << printable(line_.id.line)
                   << " does not show the value: another writer owns the group, access for outputs "
                      "is not all, or its PDO waits for other values\n";
    } else if (was_lost_) {
      context_.err << name_text()
                   << (is_held_ ? " was not held all the time\n" : " is not held at the end\n");
    }
    return waits ? kHeldBack : was_held_ && !was_lost_ ? kDone : kFailed;
  }

  std::string name_text() const { return printable(name_); }

  // Whether the last write to the group that the line applied is one of these.
  bool is_applied() const {
    const auto group = line_.groups.find(group_);
    return model_.freshness(line_) == Freshness::live && is_published_ &&
           group != line_.groups.end() && group->second.state.arming == arming_ &&
           !group->second.state.arming_wanted;
  }

  // The image may still have an earlier write; this checks that the line accepted this one.
  bool is_sent() const {
    return is_applied() && outputs().valid(value_.entry) &&
           outputs().value(value_.entry) == wanted_;
  }

  // Why is_sent() is false.
  std::string why_not() const {
    const std::string line = printable(line_.id.line);
    const Freshness freshness = model_.freshness(line_);
    if (freshness != Freshness::live) {
      return freshness == Freshness::gone
                 ? "the gateway of " + line + " has ended, or cannot be reached"
                 : line + " is not heard any more";
    }
    if (!is_published_) {
      return "DDS does not take the value";
    }
    const auto group = line_.groups.find(group_);
    if (group == line_.groups.end() || group->second.state.applied == 0) {
      return line + " was started again and has not taken the value yet";
    }
    const line::OutputState& state = group->second.state;
    if (state.arming_wanted) {
      return "the watchdog of group " + std::to_string(group_) +
             " has fired, or another NMT master was active";
    }
    if (state.arming != arming_) {
      return (state.owner.empty() ? "an unnamed client" : printable(state.owner)) +
             " writes group " + std::to_string(group_);
    }
    if (!outputs().complete()) {
      return "no image of the outputs of " + line + " has come since it was started again";
    }
    return outputs().value(value_.entry) == wanted_
               ? name_text() + ' ' + output_state(line_, value_.entry)
               : name_text() + " has another value";
  }

  // A reload may give the name to another place, which the ID of the layout does not show. An
  // output that was given by its object remains the same.
  bool is_renamed() const {
    const auto& layout = outputs().layout;
    return name_.find(request_.entry) != std::string::npos && layout && layout->id == layout_id_ &&
           layout->entries[value_.entry].name != name_;
  }

  // A refusal of a write of this client to this group since the first one. The event has the
  // reason for people. It may be lost, suppressed, or have a text of another version; then the
  // state of the group shows the last refusal.
  std::string refusal() {
    const auto fresh = static_cast<std::ptrdiff_t>(
        std::min<std::uint64_t>(model_.events_seen() - seen_, model_.events().size()));
    seen_ = model_.events_seen();
    for (auto it = model_.events().end() - fresh; it != model_.events().end(); ++it) {
      const EventView& event = it->view;
      const auto* const refused = event.get<event::OutputRefused>();
      if (it->id == line_.id && refused != nullptr && refused->group == group_ &&
          event.number > events_before_ &&
          (client_.empty() || names_client(event.text, printable(client_)))) {
        return printable(event.text) + group_hint();
      }
    }
    const auto group = line_.groups.find(group_);
    if (group == line_.groups.end() || client_.empty()) {
      return {};
    }
    const line::OutputState& state = group->second.state;
    const bool is_mine = state.refusal != line::OutputRefusal::none &&
                         state.refused_client == client_ && state.refused != refused_before_;
    return is_mine ? "outputs of group " + std::to_string(group_) +
                         " refused: " + std::string(line::describe(state.refusal)) + group_hint()
                   : "";
  }

  // Why the value is not written any more: another incarnation of the gateway, a new name, or a
  // refusal.
  std::string why_it_ends() {
    if (line_.view->incarnation != incarnation_) {
      return "the gateway of " + printable(line_.id.line) + " was started again: " + name_text() +
             " is not written any more, decide again";
    }
    if (is_renamed()) {
      return printable(name_) + " is " + printable(outputs().layout->entries[value_.entry].name) +
             " since a reload: not written any more";
    }
    return refusal();
  }

  Context& context_;
  const HoldRequest& request_;
  Model& model_;
  const Line& line_;
  EntryGroup entry_group_;
  std::uint16_t group_ = 0;
  line::OutputValue value_;
  std::vector<std::byte> wanted_;
  std::uint64_t layout_id_ = 0;
  std::string name_;               // of the entry
  std::uint64_t incarnation_ = 0;  // of the gateway
  std::uint64_t arming_ = 0;
  std::uint64_t events_before_ = 0;  // events up to this number precede the first write
  std::uint64_t seen_ = 0;
  std::string client_;                // the name of this client; empty: not known
  std::uint64_t refused_before_ = 0;  // number of refusals before the first write
  bool is_published_ = true;          // DDS took the last write
  bool is_held_ = false;
  bool was_held_ = false;
  bool was_lost_ = false;  // after it was held
};

}  // namespace

int hold(Context& context, const HoldRequest& request, const std::function<bool()>& stopped) {
  Model model;
  const Line* const line = find_line(context, model, request.line);
  if (line == nullptr) {
    return kFailed;
  }
  Holder holder(context, request, model, *line);
  const int code = holder.prepare();
  return code == kDone ? holder.run(stopped) : code;
}

}  // namespace linegate::console
