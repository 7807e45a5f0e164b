// SPDX-License-Identifier: Apache-2.0
// Keeps log messages as long as it exists, instead of printing them.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/sinks/ringbuffer_sink.h>
#include <spdlog/spdlog.h>

namespace linegate::gateway {

class LogKeeper {
 public:
  LogKeeper() : before_(spdlog::default_logger()) {
    sink_->set_pattern("%l %v");
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("", sink_));
  }
  ~LogKeeper() { spdlog::set_default_logger(before_); }
  LogKeeper(const LogKeeper&) = delete;
  LogKeeper& operator=(const LogKeeper&) = delete;

  // "LEVEL TEXT", oldest first. May be called from any thread.
  std::vector<std::string> lines() {
    std::vector<std::string> lines = sink_->last_formatted();
    for (std::string& line : lines) {
      line.erase(line.find_last_not_of("\r\n") + 1);
    }
    return lines;
  }

 private:
  std::shared_ptr<spdlog::sinks::ringbuffer_sink_mt> sink_ =
      std::make_shared<spdlog::sinks::ringbuffer_sink_mt>(1000);
  std::shared_ptr<spdlog::logger> before_;
};

}  // namespace linegate::gateway
