// SPDX-License-Identifier: Apache-2.0
// Which snapshots of one direction become samples of ProcessImage.
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/config/plant.h"
#include "stack/image/snapshot.h"

namespace linegate::gateway {

// A line hands over snapshots for more than one purpose; with the rule on_change only those with a
// change are samples. Samples are numbered without gaps; the receptions of
// those skipped go into the next one.
class ImageSequence {
 public:
  explicit ImageSequence(config::Publish::Rule rule) : rule_(rule) {}

  // True: snapshot, with its number and the receptions of those skipped, is to be published.
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
