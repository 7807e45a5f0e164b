// SPDX-License-Identifier: Apache-2.0
// Selects the snapshots of one direction that are published as ProcessImage.
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/config/plant.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// Adds receptions that are later than those of `marks`.
void merge_marks(std::vector<image::PdoMark>& marks, const std::vector<image::PdoMark>& newer);

// A line hands over snapshots for several purposes; with the rule on_change only those with a
// change are published. Published snapshots are numbered without gaps, and include the receptions
// of the skipped ones before them.
class ImageSequence {
 public:
  explicit ImageSequence(config::Publish::Rule rule) : rule_(rule) {}

  // Returns true if the snapshot must be published, and sets its number and adds the receptions of
  // skipped ones.
  bool admit(image::Snapshot& snapshot);

 private:
  bool changed(const image::Snapshot& snapshot) const;

  config::Publish::Rule rule_;
  std::uint64_t number_ = 0;
  std::vector<std::uint64_t> last_valid_;
  std::vector<std::uint64_t> last_known_;
  std::vector<image::PdoMark> skipped_;
};

}  // namespace linegate::gateway
