// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/parameter_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

constexpr mode_t kFileMode = 0644;

}  // namespace

int FileCalls::create(const std::string& path) {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kFileMode);
}

int FileCalls::open_folder(const std::string& path) {
  return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

std::ptrdiff_t FileCalls::write(int descriptor, std::span<const std::byte> bytes) {
  return ::write(descriptor, bytes.data(), bytes.size());
}

int FileCalls::sync(int descriptor) {
  return ::fsync(descriptor);
}

int FileCalls::close(int descriptor) {
  return ::close(descriptor);
}

int FileCalls::rename(const std::string& from, const std::string& to) {
  return ::rename(from.c_str(), to.c_str());
}

int FileCalls::remove(const std::string& path) {
  return ::unlink(path.c_str());
}

int FileCalls::append(const std::string& path, std::uint64_t& size) {
  constexpr off_t kLongestLine = 4096;
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, kFileMode);
  const off_t end = descriptor < 0 ? -1 : ::lseek(descriptor, 0, SEEK_END);
  size = end > 0 ? static_cast<std::uint64_t>(end) : 0;
  std::array<char, kLongestLine> tail;
  const off_t begin = std::max<off_t>(end - kLongestLine, 0);
  const ssize_t got = end > 0 ? ::pread(descriptor, tail.data(), tail.size(), begin) : 0;
  ssize_t keep = got;
  while (keep > 0 && tail[static_cast<std::size_t>(keep - 1)] != '\n') {
    --keep;
  }
  if (keep < got && (keep > 0 || begin == 0)) {
    size = static_cast<std::uint64_t>(begin + keep);
    truncate(descriptor, size);
  }
  return descriptor;
}

int FileCalls::truncate(int descriptor, std::uint64_t size) {
  return ::ftruncate(descriptor, static_cast<off_t>(size));
}

int FileCalls::read(const std::string& path, std::vector<std::byte>& bytes) {
  bytes.clear();
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return errno;
  }
  std::array<std::byte, 4096> part;
  std::ptrdiff_t got = 0;
  do {
    got = ::read(descriptor, part.data(), part.size());
    if (got > 0) {
      bytes.insert(bytes.end(), part.begin(), part.begin() + got);
    }
  } while (got > 0 || (got < 0 && errno == EINTR));
  const int problem = got < 0 ? errno : 0;
  ::close(descriptor);
  return problem;
}

FileCalls& FileCalls::system() {
  static FileCalls calls;
  return calls;
}

ParameterFile::ParameterFile(std::string path, FileCalls& calls)
    : path_(std::move(path)),
      beside_(path_ + ".new"),
      folder_(std::filesystem::path(path_).parent_path().string()),
      calls_(calls) {
  if (folder_.empty()) {
    folder_ = ".";
  }
}

bool ParameterFile::read(std::vector<std::byte>& image) {
  const int problem = calls_.read(path_, image);
  if (problem == ENOENT) {
    image.clear();
    return true;
  }
  return problem == 0 && !image.empty();
}

bool ParameterFile::keep(std::span<const std::byte> image) {
  if (!write_beside(image) || calls_.rename(beside_, path_) != 0) {
    calls_.remove(beside_);
    return false;
  }
  return sync_folder();
}

bool ParameterFile::write_beside(std::span<const std::byte> image) {
  const int descriptor = calls_.create(beside_);
  if (descriptor < 0) {
    return false;
  }
  bool good = true;
  while (good && !image.empty()) {
    const std::ptrdiff_t written = calls_.write(descriptor, image);
    good = written > 0 || (written < 0 && errno == EINTR);
    image = image.subspan(written > 0 ? static_cast<std::size_t>(written) : 0);
  }
  good = good && calls_.sync(descriptor) == 0;
  return calls_.close(descriptor) == 0 && good;
}

bool ParameterFile::sync_folder() {
  const int descriptor = calls_.open_folder(folder_);
  if (descriptor < 0) {
    return false;
  }
  const bool good = calls_.sync(descriptor) == 0;
  return calls_.close(descriptor) == 0 && good;
}

namespace {

std::string path_of(const std::string& folder, const std::string& name, std::uint8_t node,
                    const char* suffix) {
  const std::string file =
      (name.empty() ? std::string("node") : name) + '-' + std::to_string(node) + suffix;
  return (std::filesystem::path(folder) / file).string();
}

}  // namespace

std::string parameter_path(const std::string& folder, const std::string& name, std::uint8_t node) {
  return path_of(folder, name, node, ".parameters");
}

std::string lss_path(const std::string& folder, const std::string& name, std::uint8_t node) {
  return path_of(folder, name, node, ".lss");
}

std::optional<Diagnostic> make_parameter_folder(const std::string& folder) {
  if (folder.empty()) {
    return std::nullopt;
  }
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (!problem) {
    return std::nullopt;
  }
  return Diagnostic{Severity::error, folder, 0, 0,
                    "the folder for stored parameters cannot be made: " + problem.message()};
}

}  // namespace linegate::gateway
