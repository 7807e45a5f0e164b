// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/whole_file.h"

#include <array>
#include <cerrno>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace linegate::config {
namespace {

class Descriptor {
 public:
  // O_NONBLOCK opens a pipe without waiting for a writer.
  explicit Descriptor(const std::filesystem::path& path)
      : descriptor_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {}
  ~Descriptor() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  bool valid() const { return descriptor_ >= 0; }
  bool is_regular() const {
    struct stat status {};
    return ::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode);
  }
  // Returns -1 with errno set.
  ssize_t read(std::array<char, 65'536>& part) const {
    for (;;) {
      const ssize_t count = ::read(descriptor_, part.data(), part.size());
      if (count >= 0 || errno != EINTR) {
        return count;
      }
    }
  }

 private:
  int descriptor_;
};

}  // namespace

std::optional<std::string> whole_file(const std::filesystem::path& path, std::string& why) {
  const Descriptor file(path);
  why = "cannot be read";
  if (!file.valid()) {
    return std::nullopt;
  }
  if (!file.is_regular()) {
    why = "cannot be read: it is no regular file";
    return std::nullopt;
  }
  std::string out;
  std::array<char, 65'536> part;
  for (ssize_t count = file.read(part); count != 0; count = file.read(part)) {
    if (count < 0) {
      return std::nullopt;
    }
    out.append(part.data(), static_cast<std::size_t>(count));
    if (out.size() > kLargestFile) {
      why = "cannot be read: it has more than " + std::to_string(kLargestFile / 1'000'000) + " MB";
      return std::nullopt;
    }
  }
  return out;
}

std::optional<std::string> whole_file(const std::filesystem::path& path) {
  std::string ignored;
  return whole_file(path, ignored);
}

}  // namespace linegate::config
