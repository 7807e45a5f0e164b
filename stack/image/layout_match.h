// SPDX-License-Identifier: Apache-2.0
// Whether a received image may be read through the layout with the same ID.
//
// The ID does not include the names of the entries, and nothing orders images and layouts: they are
// different topics. After a restart of a line, as a reload causes it, an image from before it may
// be the newest one when the new layout arrives, and the first image after it may arrive before
// the new layout. Both would give the value of one input to another.
//
// Invariant: after a layout that reads an ID otherwise than an earlier layout did, or a series of
// images that begins anew with the same ID, an image counts when
// 1. kRepair has passed since the last of these changes, so that DDS has repeated what it lost, and
// 2. it was received kRepair after the layout or later, or its series began kRepair before the
//    layout at the earliest, or kSettled has passed since the layout.
// A line that starts publishes its first image at once, so 2 is true soon, even if no input
// changes; kSettled is for a layout that came late. An ID that had no other layout needs none of
// this.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"

namespace linegate::image {

// Of one direction of a line, as one publisher sends it.
class LayoutMatch {
 public:
  static constexpr Duration kRepair = std::chrono::seconds(1);
  static constexpr Duration kSettled = std::chrono::seconds(10);

  // Whether it comes late from a writer that the gateway has replaced: DDS orders the samples of
  // one writer only. known: the newest one. Ignore such an image.
  bool is_overtaken(const std::optional<Snapshot>& known, const Snapshot& fresh, Instant now) const;

  // known: the newest one before it; nothing: the first one of a publisher. Call it for each
  // layout.
  void take(const std::optional<Layout>& known, const Layout& fresh, Instant now);
  // Likewise; a repetition of the known image is ignored.
  void take(const std::optional<Snapshot>& known, const Snapshot& fresh, Instant now);

  // Whether the newest image belongs to the newest layout, if both have the same ID.
  bool is_certain(Instant now) const;

 private:
  static constexpr std::size_t kMostIds = 32;

  std::vector<std::pair<std::uint64_t, std::uint64_t>> readings_;  // by ID; the newest at the end
  std::optional<Instant> changed_;    // when a layout came that reads its ID otherwise
  std::optional<Instant> restarted_;  // when the first image of another series came
  Instant began_{};                   // when the first image of the present series came
  Instant heard_{};                   // the newest image
};

}  // namespace linegate::image
