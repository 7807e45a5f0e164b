// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/record_file.h"

#include <cerrno>
#include <utility>

#include <unistd.h>

namespace linegate::gateway {

RecordFile::RecordFile(config::Record plan, FileCalls& calls)
    : plan_(std::move(plan)), calls_(calls) {
  if (!is_file()) {
    descriptor_ = STDOUT_FILENO;
  }
}

RecordFile::~RecordFile() {
  close();
}

std::string RecordFile::older(unsigned number) const {
  return number == 0 ? plan_.file : plan_.file + '.' + std::to_string(number);
}

int RecordFile::open() {
  if (descriptor_ >= 0) {
    return 0;
  }
  descriptor_ = calls_.append(plan_.file, size_);
  return descriptor_ >= 0 ? 0 : errno;
}

void RecordFile::close() {
  if (is_file() && descriptor_ >= 0) {
    calls_.close(descriptor_);
    descriptor_ = -1;
  }
}

// Removes the oldest file and increments the number of all others.
int RecordFile::rotate() {
  close();
  if (calls_.remove(older(plan_.files - 1)) != 0 && errno != ENOENT) {
    return errno;
  }
  for (unsigned number = plan_.files - 1; number > 0; --number) {
    if (calls_.rename(older(number - 1), older(number)) != 0 && errno != ENOENT) {
      return errno;
    }
  }
  return open();
}

int RecordFile::append(std::string_view lines) {
  int error = open();
  if (error == 0 && is_file() && size_ > 0 && size_ + lines.size() > plan_.max_size) {
    error = rotate();
  }
  if (error != 0) {
    return error;
  }
  const auto bytes = std::as_bytes(std::span(lines.data(), lines.size()));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const std::ptrdiff_t written = calls_.write(descriptor_, bytes.subspan(done));
    if (written <= 0 && errno != EINTR) {
      error = errno;
      break;
    }
    done += written > 0 ? static_cast<std::size_t>(written) : 0;
  }
  if (error == 0) {
    size_ += bytes.size();
  } else if (is_file()) {
    calls_.truncate(descriptor_, size_);
    close();
  }
  return error;
}

}  // namespace linegate::gateway
