// SPDX-License-Identifier: Apache-2.0
// What a client in another process receives of images, in memory that the processes share.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <new>
#include <string>

#include <sys/mman.h>

#include "bridges/dds/client.h"

#include "tests/bench/measure.h"

namespace linegate::bench {

struct ImageCounts {
  std::atomic<std::uint64_t> received{0};
  std::atomic<std::uint64_t> lost{0};  // numbers that were left out
  std::atomic<std::uint64_t> lines{0};
};

class ImageCounter final : public dds::ClientListener {
 public:
  explicit ImageCounter(ImageCounts& counts) : counts_(counts) {}

  void on_image(const dds::Source& source, const image::Snapshot& image) override {
    if (image.direction != image::Direction::inputs) {
      return;
    }
    const auto [last, is_new] = last_.try_emplace(source.line, image.sequence);
    if (!is_new && image.sequence > last->second) {
      counts_.lost += image.sequence - last->second - 1;
    }
    last->second = image.sequence;
    counts_.lines = last_.size();
    ++counts_.received;
  }

 private:
  ImageCounts& counts_;
  std::map<std::string, std::uint64_t, std::less<>> last_;
};

// A new T that this process shares with those that it starts.
template <class T>
T& make_shared_with_children() {
  void* const memory =
      ::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  require(memory != MAP_FAILED, "no shared memory");
  return *new (memory) T{};
}

}  // namespace linegate::bench
