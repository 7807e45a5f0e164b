// SPDX-License-Identifier: Apache-2.0
// Selects the snapshots of one direction that are published as ProcessImage.
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/config/plant.h"
#include "stack/image/merged_snapshots.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

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
  config::Publish::Rule rule_;
  std::uint64_t number_ = 0;
  image::LastPublished published_;
  std::vector<image::PdoMark> skipped_;
  std::vector<image::PdoMark> scratch_;
};

}  // namespace linegate::gateway
