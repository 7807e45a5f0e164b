// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/log_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

namespace linegate::can_bridge {
namespace {

// A log that is none at all has as many bad lines as lines.
constexpr std::size_t kMostReported = 20;

Diagnostic finding(Severity severity, const std::string& path, std::string text) {
  return {severity, path, 0, 0, std::move(text)};
}

std::string listed(const std::set<std::string, std::less<>>& names) {
  std::string out;
  for (const std::string& name : names) {
    out += (out.empty() ? "" : ", ") + name;
  }
  return out;
}

}  // namespace

LogFile::LogFile() : buffer_(std::make_unique<char[]>(kBuffer)) {
}

LogFile::~LogFile() {
  close();
}

int LogFile::open(const std::string& path) {
  close();
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0) {
    return errno;
  }
  // What a device or a pipe gives has no end, or is not there yet.
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    close();
    return S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
  }
  begin_ = end_ = 0;
  line_ = 0;
  return 0;
}

int LogFile::open_standard_input() {
  close();
  descriptor_ = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0);
  begin_ = end_ = 0;
  line_ = 0;
  return descriptor_ < 0 ? errno : 0;
}

void LogFile::close() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
  descriptor_ = -1;
}

// More bytes behind those that are left. False if there are none, or no room.
bool LogFile::fill() {
  std::memmove(buffer_.get(), buffer_.get() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (end_ == kBuffer) {
    return false;
  }
  ssize_t got = -1;
  do {
    got = ::read(descriptor_, buffer_.get() + end_, kBuffer - end_);
    if (got < 0 && errno == EAGAIN) {  // a pipe that another process made non-blocking
      pollfd waiting{.fd = descriptor_, .events = POLLIN, .revents = 0};
      (void)::poll(&waiting, 1, -1);
    }
  } while (got < 0 && (errno == EINTR || errno == EAGAIN));
  end_ += got > 0 ? static_cast<std::size_t>(got) : 0;
  return got > 0;
}

bool LogFile::next_line(bool& complete, bool& too_long) {
  complete = true;
  too_long = false;
  std::size_t looked_at = 0;
  for (;;) {
    const char* begin = buffer_.get() + begin_;
    const void* newline = std::memchr(begin + looked_at, '\n', end_ - begin_ - looked_at);
    if (newline != nullptr) {
      const auto length = static_cast<std::size_t>(static_cast<const char*>(newline) - begin);
      text_ = {begin, length};
      begin_ += length + 1;
      ++line_;
      return true;
    }
    looked_at = end_ - begin_;
    if (fill()) {
      continue;
    }
    if (end_ - begin_ < kBuffer) {
      break;
    }
    too_long = true;  // what came until now is not looked at
    begin_ = end_ = 0;
    looked_at = 0;
  }
  if (begin_ == end_ && !too_long) {
    return false;
  }
  complete = false;
  text_ = {buffer_.get() + begin_, end_ - begin_};
  begin_ = end_;
  ++line_;
  return true;
}

LogFile::Next LogFile::next(LogEntry& out, LogProblem& problem) {
  bool complete = true;
  bool too_long = false;
  while (is_open() && next_line(complete, too_long)) {
    if (too_long) {
      problem = {1, "a line as long as no log has it"};
      return Next::bad;
    }
    if (!parse_log_line(text_, out, problem)) {
      return complete ? Next::bad : Next::cut_short;
    }
    if (out.kind != LogEntry::Kind::remark) {
      return Next::entry;
    }
  }
  return Next::end;
}

std::vector<Diagnostic> check_log(const std::string& path, std::string_view interface) {
  LogFile file;
  if (const int error = file.open(path)) {
    return {finding(Severity::error, path,
                    "the log cannot be read: " + std::generic_category().message(error))};
  }
  std::vector<Diagnostic> out;
  std::set<std::string, std::less<>> interfaces;
  std::size_t bad = 0;
  LogEntry entry;
  LogProblem problem;
  for (auto next = file.next(entry, problem); next != LogFile::Next::end;
       next = file.next(entry, problem)) {
    if (next == LogFile::Next::entry) {
      if (entry.kind != LogEntry::Kind::frames_lost && !interfaces.contains(entry.interface)) {
        interfaces.emplace(entry.interface);
      }
      continue;
    }
    const bool last = next == LogFile::Next::cut_short;
    bad += last ? 0U : 1U;
    if (last || bad <= kMostReported) {
      out.push_back({last ? Severity::warning : Severity::error, path, file.line(), problem.column,
                     (last ? "the log ends within a line: " : "") + std::string(problem.text)});
    }
  }
  if (bad > kMostReported) {
    out.push_back(finding(Severity::error, path,
                          std::to_string(bad - kMostReported) + " more lines are not of a log"));
  }
  if (interfaces.empty() || (!interface.empty() && !interfaces.contains(interface))) {
    out.push_back(finding(Severity::error, path,
                          interfaces.empty() ? std::string("there is no frame in the log")
                                             : "the log has no frame of " + std::string(interface) +
                                                   ", but of " + listed(interfaces)));
  } else if (interface.empty() && interfaces.size() > 1) {
    out.push_back(finding(Severity::warning, path,
                          "the log has frames of " + listed(interfaces) +
                              "; all are replayed. Choose with ?interface=" + *interfaces.begin()));
  }
  return out;
}

}  // namespace linegate::can_bridge
