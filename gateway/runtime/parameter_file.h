// SPDX-License-Identifier: Apache-2.0
// Stored parameters (CiA 301, 1010h) of one device in a file of its own: whenever the process is
// killed or power fails, the file has the old contents or the new, whole. The format, with its CRC,
// is the stack's: stack/storage/image.h.
//
// The new contents are written beside the old ("NAME.new") and forced to the disk, then renamed
// over the old, then the folder is forced to the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/storage/medium.h"

namespace linegate::gateway {

// The system calls that it takes, so that a test can stop after any of them. Each gives what the
// call of its name gives and sets errno.
class FileCalls {
 public:
  virtual ~FileCalls() = default;
  virtual int create(const std::string& path);  // open() for writing, empty
  virtual int open_folder(const std::string& path);
  virtual std::ptrdiff_t write(int descriptor, std::span<const std::byte> bytes);
  virtual int sync(int descriptor);  // fsync()
  virtual int close(int descriptor);
  virtual int rename(const std::string& from, const std::string& to);
  virtual int remove(const std::string& path);  // unlink()
  // open() for appending to a file of lines: an incomplete last line is cut off, size is what is
  // left.
  virtual int append(const std::string& path, std::uint64_t& size);
  virtual int truncate(int descriptor, std::uint64_t size);  // ftruncate()
  // All of a file: 0, or errno.
  virtual int read(const std::string& path, std::vector<std::byte>& bytes);

  static FileCalls& system();
};

class ParameterFile final : public storage::Medium {
 public:
  // The folder of path must exist. calls must outlive the file.
  explicit ParameterFile(std::string path, FileCalls& calls = FileCalls::system());

  // A file that does not exist is nothing stored; an empty one cannot be read.
  bool read(std::vector<std::byte>& image) override;
  // Waits for the disk.
  bool keep(std::span<const std::byte> image) override;

 private:
  bool write_beside(std::span<const std::byte> image);
  bool sync_folder();

  std::string path_;
  std::string beside_;
  std::string folder_;
  FileCalls& calls_;
};

// FOLDER/NAME-5.parameters; FOLDER/node-5.parameters without a name.
std::string parameter_path(const std::string& folder, const std::string& name, std::uint8_t node);
// The file with the node-ID that LSS gave it: the same, "NAME-NODE.lss".
std::string lss_path(const std::string& folder, const std::string& name, std::uint8_t node);

// Makes the folder, and those above it, if it is not there. What is wrong if it cannot be; nothing
// for an empty name.
std::optional<Diagnostic> make_parameter_folder(const std::string& folder);

}  // namespace linegate::gateway
