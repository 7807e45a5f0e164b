// SPDX-License-Identifier: Apache-2.0
// Checks that every numbered frame is in the images of a line.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/image/layout.h"
#include "stack/image/snapshot.h"

namespace linegate::bench {

// The PDOs have the contents of numbered(), see load_sender.h.
class NumbersInImage {
 public:
  explicit NumbersInImage(image::Layout layout);

  // Processes the next image, in order. It may merge the changes of several frames.
  void take(const image::Snapshot& snapshot);

  std::uint64_t frames() const { return frames_; }    // frames in all images
  std::uint64_t missing() const { return missing_; }  // numbers that were skipped
  std::uint64_t torn() const { return torn_; }        // PDOs with bytes of two frames

 private:
  std::uint64_t value(const image::Snapshot& snapshot, const image::PdoMark& mark) const;

  image::Layout layout_;
  std::vector<std::uint32_t> last_;  // last number of each local PDO
  std::uint64_t frames_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t torn_ = 0;
};

}  // namespace linegate::bench
