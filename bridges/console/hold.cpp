// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/hold.h"

#include <algorithm>
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
    seen_ = model_.events_seen();
    events_before_ = line_.view->state.counters.events;
    arming_ = static_cast<std::uint64_t>(utc_now().time_since_epoch().count());
    return kDone;
  }

  int run(const std::function<bool()>& stopped) {
    const Instant begin = steady_now();
    Instant again = begin;
    while (!stopped() &&
           (request_.time <= Duration::zero() || steady_now() - begin < request_.time)) {
      if (steady_now() >= again) {
        again = steady_now() + kWriteAgain;
        write();
      }
      poll(context_, model_, kWriteAgain / 4);
      if (const std::string why = refusal(); !why.empty()) {
        context_.err << why << group_hint() << '\n';
        return kFailed;
      }
      if (!shown_ && is_held()) {
        shown_ = true;
        context_.err << "held; the outputs of group " << group_ << " become 0 "
                     << kHoldWatchdog / std::chrono::seconds(1) << " s after the end\n";
      }
      if (!shown_ && steady_now() - begin >= context_.timeout) {
        break;
      }
    }
    if (!shown_) {
      context_.err << "the image of " << printable(line_.id.line)
                   << " does not show the value: another writer owns the group, access for outputs "
                      "is not all, or its PDO waits for other values\n";
    }
    return shown_ ? kDone : kFailed;
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

  void write() {
    line::OutputWrite out;
    out.group = group_;
    out.layout_id = layout_id_;
    out.arming = arming_;
    out.watchdog = kHoldWatchdog;
    out.reactions = line::kZeroOutputs;
    out.values.push_back(value_);
    (void)context_.client.write_outputs(line_.id, out);
  }

  // The image may still have an earlier write; this checks that the line accepted this one.
  bool is_held() const {
    const auto group = line_.groups.find(group_);
    return group != line_.groups.end() && group->second.state.arming == arming_ &&
           outputs().valid(value_.entry) && outputs().value(value_.entry) == wanted_;
  }

  // A reload may give the name to another place, which the ID of the layout does not show. An
  // output that was given by its object remains the same.
  bool is_renamed() const {
    const auto& layout = outputs().layout;
    return name_.find(request_.entry) != std::string::npos && layout && layout->id == layout_id_ &&
           layout->entries[value_.entry].name != name_;
  }

  // Why the value is not written any more: a refusal of a write to this group since the first one,
  // or a new name.
  std::string refusal() {
    if (is_renamed()) {
      return printable(name_) + " is " + printable(outputs().layout->entries[value_.entry].name) +
             " since a reload: not written any more";
    }
    const auto fresh = static_cast<std::ptrdiff_t>(
        std::min<std::uint64_t>(model_.events_seen() - seen_, model_.events().size()));
    seen_ = model_.events_seen();
    for (auto it = model_.events().end() - fresh; it != model_.events().end(); ++it) {
      const EventView& event = it->view;
      const auto* const refused = event.get<event::OutputRefused>();
      if (it->id == line_.id && refused != nullptr && refused->group == group_ &&
          event.number > events_before_) {
        return printable(event.text);
      }
    }
    return {};
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
  std::string name_;  // of the entry
  std::uint64_t arming_ = 0;
  std::uint64_t events_before_ = 0;  // events up to this number precede the first write
  std::uint64_t seen_ = 0;
  bool shown_ = false;
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
