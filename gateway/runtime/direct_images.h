// SPDX-License-Identifier: Apache-2.0
// The images of a line on their way from its executor to a process that publishes them, without the
// publisher in between (dds: {process: own}).
//
// The numbers of published images are those of the records (exchange/shared_slots.h): gapless, and
// each belongs to one image, whatever the other process does and however often it is replaced.
// While it does not take images, newer values replace older ones, and changes and receptions add
// up.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/exchange/bell.h"
#include "gateway/exchange/handover.h"
#include "gateway/exchange/shared_slots.h"
#include "gateway/runtime/clock.h"
#include "stack/image/layout.h"
#include "stack/image/merged_snapshots.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// Selects the receptions for which the publisher must be woken: those of PDOs whose update is due.
// It looks for all others by itself (PdoUpdates::next_look()).
class UpdateWakes {
 public:
  UpdateWakes(Duration min_period, const image::Layout& inputs);

  bool due(const image::Snapshot& inputs, Instant now);

 private:
  Duration min_period_;
  std::vector<Instant> due_;  // by local_pdo
};

class DirectImages {
 public:
  // layouts: those of the line, which never change. bell: wakes the other process. Throws
  // std::system_error.
  DirectImages(const config::LinePlan& plan, const std::array<image::Layout, 2>& layouts,
               std::shared_ptr<exchange::Bell> bell);

  // Records of inputs and outputs, by image::Direction.
  exchange::SlotWriter& records() { return records_; }

  // --- the executor of the line
  // -------------------------------------------------------------------

  // The snapshot to take, which always has only what is new.
  image::Snapshot& draft(image::Direction direction) { return side(direction).snapshot; }
  // The draft was taken: it is published as soon as there is room, if the rule of the line wants
  // it. Returns true if the publisher must be woken, to which the inputs are handed over.
  bool taken(image::Direction direction, const ClockMap& clock, Instant now,
             exchange::Handover<image::Snapshot>& to_publisher);
  // Publishes an image that has waited for room.
  void publish_waiting(image::Direction direction, const ClockMap& clock, Instant now);
  // When publish_waiting() is to be called; kNever: none waits.
  Instant next_try() const { return earlier(sides_[0].retry, sides_[1].retry); }
  // Wakes the other process if there is something new for it.
  void announce();

 private:
  // While there is no room. After a second, it will take longer.
  static constexpr Duration kRetry = std::chrono::milliseconds(5);
  static constexpr Duration kLateRetry = std::chrono::milliseconds(100);
  static constexpr Duration kLate = std::chrono::seconds(1);

  struct Side {
    image::Snapshot snapshot;
    // Of the snapshots since the last published one, without the newest.
    std::vector<image::PdoMark> marks;
    std::vector<std::uint64_t> changed;
    image::LastPublished published;
    Instant retry = kNever;
    Instant waiting_since{};
  };

  Side& side(image::Direction direction) { return sides_[static_cast<std::size_t>(direction)]; }
  bool is_wanted(const Side& side) const;
  void publish(image::Direction direction, const ClockMap& clock, Instant now);
  void hand_over(const image::Snapshot& inputs, exchange::Handover<image::Snapshot>& to);

  const config::Publish::Rule rule_;
  const std::shared_ptr<exchange::Bell> bell_;
  std::array<Side, 2> sides_;
  std::vector<image::PdoMark> scratch_;
  std::vector<image::PdoMark> unread_;
  UpdateWakes wakes_;
  bool news_ = false;
  exchange::SlotWriter records_;
};

}  // namespace linegate::gateway
