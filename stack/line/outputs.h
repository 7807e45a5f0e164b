// SPDX-License-Identifier: Apache-2.0
// The outputs of a line as applications use them: groups, arming and watchdogs.
//
// Has no values: it decides whether an OutputWrite may be applied, and which effects it has.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/events.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"

namespace linegate::line {

class Outputs {
 public:
  // A group with its watchdog.
  struct Group {
    OutputGroup config;
    std::uint64_t arming = 0;
    std::optional<std::uint64_t> burnt;  // arming number at the last reaction: refused from then on
    bool armed = false;    // a first write was applied since the start or the last reaction
    bool tripped = false;  // the watchdog has fired and nothing was applied since
    // Disarmed by disarm(), and not all of its values were written since: writes send unchanged
    // values, too.
    bool resends = false;
    Duration watchdog{};
    std::uint8_t reactions = kHoldOutputs;
    Instant deadline = kNever;
    // About its writes, for OutputState.
    std::string owner;
    std::uint32_t owner_number = 0;  // OutputWrite::client_number
    std::uint64_t applied = 0;
    Instant applied_at{};
    std::uint64_t refused = 0;
    Instant refused_at{};
    OutputRefusal refusal = OutputRefusal::none;
    std::string refused_client;
    std::uint32_t refused_number = 0;  // OutputWrite::client_number
  };

  // The layout must outlive it. If no groups are configured, or forwarded ones alone, there is one,
  // number 0, with all entries that are not bound; bound entries are in no group. Those of
  // forwarded groups are bound, too.
  Outputs(const image::Layout& layout, std::vector<OutputGroup> groups,
          const std::vector<std::uint32_t>& bound = {});

  // Checks a write completely. Changes nothing.
  OutputRefusal check(const OutputWrite& write) const;
  // Precondition: check() returned OutputRefusal::none. Arms or re-arms the group's watchdog.
  // Returns true if that was its first write since the start or a reaction.
  bool accept(const OutputWrite& write, Instant now);

  // A write to a group was refused, here or by the owner of the line. No effect on unknown groups.
  // client: OutputWrite::client; empty: only its number is known.
  void note_refused(const event::OutputRefused& refused, std::string_view client, Instant now);
  // The client whose outputs the write takes over; nothing if its group is not in use, or by the
  // same client. Precondition: check() returned OutputRefusal::none.
  std::optional<std::uint32_t> displaces(const OutputWrite& write) const;
  // For a write that is applied later: if its group is in use, its watchdog starts again, with the
  // time of the last write that was applied. Returns false, without effect, if check() refuses the
  // write.
  bool feed(const OutputWrite& write, Instant now);
  // Fills OutputState except its waits. Precondition: position < groups().size().
  void describe(std::size_t position, OutputState& out) const;

  // Whether the watchdog of a group with the reaction kSendEmcy has fired and no write was applied
  // since.
  bool any_silent() const;
  // A group whose watchdog has expired at `now`, which becomes tripped; nullptr if there is none.
  const Group* expire(Instant now);
  // Ends the use of all groups, without a reaction: a write needs another arming number.
  void disarm();
  // All values of the group were written. Precondition: the group exists.
  void note_complete(std::uint16_t group);
  Instant next_wake() const { return next_deadline_; }

  // The group of the entry, if its watchdog has fired and no write was applied since; nullptr if it
  // has not. Until then the values are those that the reaction left.
  const Group* fired_group(std::uint32_t entry) const;
  // Whether the entry follows an input, of this gateway or of another one.
  bool is_bound(std::uint32_t entry) const { return bound_[entry]; }

  const Group* group(std::uint16_t number) const;
  const std::vector<Group>& groups() const { return groups_; }

 private:
  // Position in groups_; its size if there is no such group.
  std::size_t position_of(std::uint16_t number) const;
  Group* find(std::uint16_t number);
  bool in_group(std::uint32_t entry, std::uint16_t group_position) const;
  // The refusal for an entry that is not in the group.
  OutputRefusal foreign_entry(std::uint32_t entry) const;
  OutputRefusal check_bytes(const OutputBytes& run, std::uint16_t group_position) const;
  void follow_deadlines();

  static constexpr std::uint16_t kNoGroup = 0xFFFF;

  const image::Layout& layout_;
  Instant next_deadline_ = kNever;  // the earliest of all groups
  std::vector<Group> groups_;
  std::vector<std::uint16_t> group_of_;     // entry -> position in groups_, kNoGroup = in no group
  std::vector<bool> bound_;                 // by entry
  std::vector<std::uint32_t> by_position_;  // entries ascending by bit offset
};

// Adds the entries of the group that are not valid to OutputState, each with reason_of(entry).
template <class ReasonOf>
void add_waits(const Outputs::Group& group, const image::ProcessImage& image, ReasonOf reason_of,
               OutputState& out) {
  for (const std::uint32_t entry : group.config.entries) {
    if (image.is_valid(image::Direction::outputs, entry)) {
      continue;
    }
    ++out.waiting;
    if (out.waits.size() < OutputState::kMostWaits) {
      out.waits.push_back({entry, reason_of(entry)});
    }
  }
}

// At most one NMT reaction and no unknown bits.
bool valid_reactions(std::uint8_t reactions);

}  // namespace linegate::line
