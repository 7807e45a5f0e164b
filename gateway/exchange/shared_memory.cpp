// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/shared_memory.h"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace linegate::exchange {
namespace {

constexpr int kSealsOfSize = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
constexpr int kReadOnly = 0x10;  // F_SEAL_FUTURE_WRITE: the mapping that exists stays writable

std::system_error failure(const char* what) {
  return {errno, std::generic_category(), what};
}

}  // namespace

SharedMemory::SharedMemory(std::size_t bytes, Other other)
    : descriptor_(memfd_create("linegate", MFD_CLOEXEC | MFD_ALLOW_SEALING)), size_(bytes) {
  if (descriptor_ < 0) {
    throw failure("memfd_create");
  }
  const int seals = kSealsOfSize | (other == Other::reads ? kReadOnly : 0);
  bool made = ftruncate(descriptor_, static_cast<off_t>(bytes)) == 0;
  if (made) {
    memory_ = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    made = memory_ != MAP_FAILED && fcntl(descriptor_, F_ADD_SEALS, seals) == 0;
  }
  if (!made) {
    const std::system_error error = failure("shared memory");
    if (memory_ != nullptr && memory_ != MAP_FAILED) {
      munmap(memory_, bytes);
    }
    close(descriptor_);
    throw error;
  }
}

SharedMemory::SharedMemory(int descriptor, std::size_t bytes, Other self) {
  struct stat file {};
  if (fstat(descriptor, &file) != 0) {
    throw failure("shared memory");
  }
  size_ = static_cast<std::size_t>(file.st_size);
  if (size_ == 0 || (bytes != kAnySize && size_ != bytes) ||
      (fcntl(descriptor, F_GET_SEALS) & kSealsOfSize) != kSealsOfSize) {
    errno = EINVAL;
    throw failure("shared memory");
  }
  const int protection = self == Other::reads ? PROT_READ : PROT_READ | PROT_WRITE;
  memory_ = mmap(nullptr, size_, protection, MAP_SHARED, descriptor, 0);
  if (memory_ == MAP_FAILED) {
    throw failure("mmap");
  }
}

SharedMemory::~SharedMemory() {
  munmap(memory_, size_);
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

}  // namespace linegate::exchange
