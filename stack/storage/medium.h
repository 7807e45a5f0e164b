// SPDX-License-Identifier: Apache-2.0
// What keeps the stored parameters of one device where they outlive power-off: a file, a flash. The
// stack gives and takes bytes (image.h) and does no I/O.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace linegate::storage {

class Medium {
 public:
  virtual ~Medium() = default;

  // At power-on: what is kept, empty if nothing is. False if it cannot be read.
  virtual bool read(std::vector<std::byte>& image) = 0;

  // From now on `image` is kept in place of what was. False if it cannot be: what was kept before
  // is kept still then. Whenever power fails, one of the two is there, whole.
  virtual bool keep(std::span<const std::byte> image) = 0;

  // True for one that takes its time: keep() only begins (false if it cannot), and Storage::done()
  // is told how it ended. Nothing else is to be kept before.
  virtual bool slow() const { return false; }
};

// Outlives the power-off of a device that exists in memory only, and ends with the process.
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
