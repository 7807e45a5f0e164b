// SPDX-License-Identifier: Apache-2.0
// A candump log, read line by line however long it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/can/candump.h"
#include "stack/base/diagnostic.h"

namespace linegate::can_bridge {

class LogFile {
 public:
  LogFile();
  ~LogFile();
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;

  // 0, or errno; EINVAL: it is no regular file. Begins at the first line.
  int open(const std::string& path);
  // The standard input, which may be a pipe: next() then waits for a line, and gives it as soon as
  // it is complete. 0, or errno.
  int open_standard_input();
  bool is_open() const { return descriptor_ >= 0; }
  void close();

  enum class Next : std::uint8_t {
    entry,      // out is set; what it points to lasts until the next call
    bad,        // line() is none: see problem
    cut_short,  // the same, and the file ends within it
    end,        // also when it cannot be read further
  };
  // Remarks are left out. Waits for the disk, and never allocates.
  Next next(LogEntry& out, LogProblem& problem);
  // The line that next() gave, from 1.
  std::uint32_t line() const { return line_; }
  // Its text, without its end.
  std::string_view text() const { return text_; }

 private:
  static constexpr std::size_t kBuffer = 65'536;

  bool fill();
  // Finds the next line. False at the end of the file.
  bool next_line(bool& complete, bool& too_long);

  int descriptor_ = -1;
  std::unique_ptr<char[]> buffer_;
  std::size_t begin_ = 0;  // what is not used in buffer_
  std::size_t end_ = 0;
  std::uint32_t line_ = 0;
  std::string_view text_;
};

// What is wrong with a log, each finding with line and column: it cannot be read, lines are none
// (the last one may be cut short: a warning), no line has a frame (of that interface, if it is not
// empty), or there are frames of several interfaces and none was chosen (a warning). Reads all of
// it.
std::vector<Diagnostic> check_log(const std::string& path, std::string_view interface);

}  // namespace linegate::can_bridge
