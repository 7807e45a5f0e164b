// SPDX-License-Identifier: Apache-2.0
// Images that were fetched while the edge did not accept them.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// The value history goes on while DDS does not. The images that it fetches meanwhile are published
// later, as one: with the values of the newest, and the changes and receptions of all, as if the
// line had merged them. Of one direction of a line.
class DeferredImage {
 public:
  static constexpr Duration kPeriod = std::chrono::milliseconds(100);  // between two images

  // Whether a fetched image waits.
  bool waits() const { return newest_ != nullptr; }
  // Whether another image is to be fetched although the edge does not accept it.
  bool is_due(Instant now) const { return now >= due_; }
  // Keeps the fetched snapshot, which exists until another one is fetched.
  void defer(image::Snapshot& snapshot, Instant now);
  // What is to be published: the fetched snapshot, or the kept one if there is none (nullptr), with
  // what the deferred ones had, if their layout is the same. nullptr if there is nothing.
  image::Snapshot* take(image::Snapshot* fetched);

 private:
  void add_earlier(image::Snapshot& to) const;

  image::Snapshot* newest_ = nullptr;
  // Of the images before the newest one, which have this layout; 0: there are none.
  std::uint64_t layout_id_ = 0;
  std::vector<std::uint64_t> changed_;
  std::vector<image::PdoMark> marks_;
  Instant due_{};
};

}  // namespace linegate::gateway
