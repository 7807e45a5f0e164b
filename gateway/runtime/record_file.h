// SPDX-License-Identifier: Apache-2.0
// A file to which complete lines are appended, and which is renamed when it has grown: NAME is the
// newest file, NAME.1 the previous one, and so on. A full disk does not leave a partial line
// behind.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "gateway/config/plant.h"
#include "gateway/runtime/parameter_file.h"

namespace linegate::gateway {

class RecordFile {
 public:
  // calls must outlive the file. An empty name is the standard output, which is never renamed.
  explicit RecordFile(config::Record plan, FileCalls& calls = FileCalls::system());
  ~RecordFile();
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  // Appends all lines and returns 0, or appends none and returns errno; the next call tries again.
  int append(std::string_view lines);

 private:
  bool is_file() const { return !plan_.file.empty(); }
  std::string older(unsigned number) const;
  int open();
  int rotate();
  void close();

  const config::Record plan_;
  FileCalls& calls_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace linegate::gateway
