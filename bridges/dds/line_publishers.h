// SPDX-License-Identifier: Apache-2.0
// Records which writer publishes each line: a line is lost with its writer.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>

namespace linegate::dds {

template <class Handle>
class LinePublishers {
 public:
  static constexpr std::size_t kMaxLines = 4'096;  // bounded: any host may publish any names

  // Returns false if kMaxLines other lines are recorded.
  bool note(const std::string& gateway, const std::string& line, const Handle& writer) {
    const std::pair key(gateway, line);
    if (writers_.size() >= kMaxLines && !writers_.contains(key))
      return false;
    writers_[key] = writer;
    return true;
  }

  void forget(const std::string& gateway, const std::string& line) {
    writers_.erase(std::pair(gateway, line));
  }

  // Removes the lines of that writer, and calls gone(gateway, line) for each.
  template <class Gone>
  void lose(const Handle& writer, Gone gone) {
    for (auto line = writers_.begin(); line != writers_.end();) {
      if (line->second != writer) {
        ++line;
        continue;
      }
      gone(line->first.first, line->first.second);
      line = writers_.erase(line);
    }
  }

 private:
  std::map<std::pair<std::string, std::string>, Handle> writers_;
};

}  // namespace linegate::dds
