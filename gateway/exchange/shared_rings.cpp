// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/shared_rings.h"

#include <atomic>
#include <cerrno>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace linegate::exchange {

struct SharedRings::Head {
  std::array<ByteRingHeader, 2> rings;
  struct alignas(kCacheLine) Progress {
    std::atomic<std::uint64_t> value{0};
  };
  std::array<Progress, kCounters> progress;
};

namespace {

constexpr std::size_t kHeadBytes = 4'096;
constexpr std::size_t kSharedBytes = kHeadBytes + 2 * SharedRings::kRingBytes;
constexpr int kSizeSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

SharedRings::SharedRings()
    : descriptor_(memfd_create("linegate", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  if (descriptor_ < 0) {
    fail("memfd_create");
  }
  if (ftruncate(descriptor_, kSharedBytes) != 0 ||
      fcntl(descriptor_, F_ADD_SEALS, kSizeSeals) != 0) {
    close(descriptor_);
    fail("shared memory");
  }
  try {
    map(descriptor_);
  } catch (...) {
    close(descriptor_);
    throw;
  }
  static_assert(sizeof(Head) <= kHeadBytes);
  new (memory_) Head();
}

SharedRings::SharedRings(int descriptor) {
  struct stat file {};
  if (fstat(descriptor, &file) != 0) {
    fail("shared memory");
  }
  if (file.st_size != static_cast<off_t>(kSharedBytes) ||
      (fcntl(descriptor, F_GET_SEALS) & kSizeSeals) != kSizeSeals) {
    errno = EINVAL;
    fail("shared memory");
  }
  map(descriptor);
}

SharedRings::~SharedRings() {
  munmap(memory_, kSharedBytes);
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

void SharedRings::map(int descriptor) {
  memory_ = mmap(nullptr, kSharedBytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (memory_ == MAP_FAILED) {
    fail("mmap");
  }
}

ByteRingHeader& SharedRings::header(std::size_t ring) const {
  return static_cast<Head*>(memory_)->rings.at(ring);
}

std::span<std::byte> SharedRings::bytes(std::size_t ring) const {
  return {static_cast<std::byte*>(memory_) + kHeadBytes + ring * kRingBytes, kRingBytes};
}

void SharedRings::add_progress(std::size_t counter) {
  static_cast<Head*>(memory_)->progress.at(counter).value.fetch_add(1, std::memory_order_relaxed);
}

std::uint64_t SharedRings::progress(std::size_t counter) const {
  return static_cast<const Head*>(memory_)->progress.at(counter).value.load(
      std::memory_order_relaxed);
}

}  // namespace linegate::exchange
