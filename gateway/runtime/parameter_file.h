// SPDX-License-Identifier: Apache-2.0
// Stores the parameters of one device (CiA 301, 1010h) in its own file. If the process is killed or
// power fails, the file has the complete old or the complete new contents. The format, with its
// CRC, is defined by the stack: stack/storage/image.h.
//
// The new contents are written to a second file ("NAME.new") and synced to the disk. Then that file
// is renamed to NAME, and the folder is synced.
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

// The system calls that ParameterFile uses, so that a test can stop after any of them. Each returns
// the result of the call of its name and sets errno.
class FileCalls {
 public:
  virtual ~FileCalls() = default;
  virtual int create(const std::string& path);  // open() for writing, truncated
  virtual int open_folder(const std::string& path);
  virtual std::ptrdiff_t write(int descriptor, std::span<const std::byte> bytes);
  virtual int sync(int descriptor);  // fsync()
  virtual int close(int descriptor);
  virtual int rename(const std::string& from, const std::string& to);
  virtual int remove(const std::string& path);  // unlink()
  // open() for appending to a file of lines: an incomplete last line is cut off; size is the
  // remaining size.
  virtual int append(const std::string& path, std::uint64_t& size);
  virtual int truncate(int descriptor, std::uint64_t size);  // ftruncate()
  // Reads a complete file. Returns 0 or errno.
  virtual int read(const std::string& path, std::vector<std::byte>& bytes);

  static FileCalls& system();
};

class ParameterFile final : public storage::Medium {
 public:
  // The folder of path must exist. calls must outlive the file.
  explicit ParameterFile(std::string path, FileCalls& calls = FileCalls::system());

  // If the file does not exist, nothing is stored; an empty file cannot be read.
  bool read(std::vector<std::byte>& image) override;
  // Blocks until the data is on the disk.
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
// The file with the node-ID that LSS assigned: the same, "NAME-NODE.lss".
std::string lss_path(const std::string& folder, const std::string& name, std::uint8_t node);

// Creates the folder and its parents if it does not exist. Returns the error if that fails; nothing
// for an empty name.
std::optional<Diagnostic> make_parameter_folder(const std::string& folder);

}  // namespace linegate::gateway
