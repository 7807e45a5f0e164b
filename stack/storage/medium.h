// SPDX-License-Identifier: Apache-2.0
// Non-volatile storage for the parameters of one device: a file, a flash memory. The stack passes
// bytes (image.h) and does no I/O.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace linegate::storage {

class Medium {
 public:
  virtual ~Medium() = default;

  // Called at power-on: reads the stored image, empty if there is none. Returns false if it cannot
  // be read.
  virtual bool read(std::vector<std::byte>& image) = 0;

  // Stores `image` in place of the previous one. Returns false if that fails: the previous image is
  // then still stored. If power fails at any time, one of the two is stored completely.
  virtual bool keep(std::span<const std::byte> image) = 0;

  // True for a slow medium: keep() only starts the work (false if that fails), and its result is
  // passed to Storage::done(). keep() is not called again before that.
  virtual bool slow() const { return false; }
};

// For a device that only exists in memory: outlives the device's power-off, and ends with the
// process.
class MemoryMedium final : public Medium {
 public:
  bool read(std::vector<std::byte>& image) override {
    image = kept_;
    return true;
  }
  bool keep(std::span<const std::byte> image) override {
    kept_.assign(image.begin(), image.end());
    return true;
  }

 private:
  std::vector<std::byte> kept_;
};

}  // namespace linegate::storage
