// SPDX-License-Identifier: Apache-2.0
// The outputs of a line as applications see them: groups, arming and watchdogs.
//
// Holds no bytes: it decides whether an OutputWrite may be applied, and says what follows from it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/layout.h"
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
    std::optional<std::uint64_t> burnt;  // arming number at the last reaction: never applied again
    bool armed = false;    // a first write was applied since the start or the last reaction
    bool tripped = false;  // the watchdog has fired and nothing was applied since
    Duration watchdog{};
    std::uint8_t reactions = kHoldOutputs;
    Instant deadline = kNever;
    // What OutputState says of its writes.
    std::string owner;
    std::uint64_t applied = 0;
    Instant applied_at{};
    std::uint64_t refused = 0;
    Instant refused_at{};
    OutputRefusal refusal = OutputRefusal::none;
    std::string refused_client;
  };

  // The layout must outlive it. Without groups in the configuration there is one, number 0, with
  // all entries but those that are bound, which no group has.
  Outputs(const image::Layout& layout, std::vector<OutputGroup> groups,
          const std::vector<std::uint32_t>& bound = {});

  // Everything that can be wrong with a write. Nothing is changed.
  OutputRefusal check(const OutputWrite& write) const;
  // Precondition: check() gave none. Arms or re-arms the group's watchdog. True if that was its
  // first write since the start or a reaction.
  bool accept(const OutputWrite& write, Instant now);

  // A write to that group was refused, here or before it came here. No effect on unknown groups.
  void note_refused(std::uint16_t group, OutputRefusal refusal, std::string_view client,
                    Instant now);
  // All of OutputState but its waits. Precondition: position < groups().size().
  void describe(std::size_t position, OutputState& out) const;

  // The watchdog of some group has fired, with kSendEmcy among its reactions, and nothing was
  // applied since.
  bool any_silent() const;
  // The group whose watchdog is over at `now`; it is tripped by that. nullptr if none.
  const Group* expire(Instant now);
  Instant next_wake() const { return next_deadline_; }

  // The entry follows an input.
  bool is_bound(std::uint32_t entry) const { return bound_[entry]; }

  const Group* group(std::uint16_t number) const;
  const std::vector<Group>& groups() const { return groups_; }

 private:
  // In groups_; its size if there is none.
  std::size_t position_of(std::uint16_t number) const;
  Group* find(std::uint16_t number);
  bool in_group(std::uint32_t entry, std::uint16_t group_position) const;
  // Of an entry that is not in the group.
  OutputRefusal foreign_entry(std::uint32_t entry) const;
  OutputRefusal check_bytes(const OutputBytes& run, std::uint16_t group_position) const;
  void follow_deadlines();

  static constexpr std::uint16_t kNoGroup = 0xFFFF;

  const image::Layout& layout_;
  Instant next_deadline_ = kNever;  // the first of all groups
  std::vector<Group> groups_;
  std::vector<std::uint16_t> group_of_;     // entry -> position in groups_, kNoGroup = in none
  std::vector<bool> bound_;                 // by entry
  std::vector<std::uint32_t> by_position_;  // entries ascending by bit offset
};

// At most one NMT reaction and no unknown bits.
bool valid_reactions(std::uint8_t reactions);

}  // namespace linegate::line
