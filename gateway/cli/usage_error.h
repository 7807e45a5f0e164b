// SPDX-License-Identifier: Apache-2.0
// Reports errors of linegate that are not refusals of a gateway: as text on standard error, and
// with --json as an object on standard output.
#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace linegate::gateway {

// {"ok":false,"domain":"usage","text":...} and a line feed. Trailing line feeds of the text are
// removed.
void print_usage_error(std::ostream& out, std::string text);
// The same with the domain "console".
void print_failure(std::ostream& out, std::string text);

// An output stream that writes to another one and records the text.
class RecordingStream : public std::ostream {
 public:
  explicit RecordingStream(std::ostream& to) : std::ostream(nullptr), buffer_(*to.rdbuf()) {
    rdbuf(&buffer_);
  }

  const std::string& text() const { return buffer_.text(); }

 private:
  class Buffer : public std::streambuf {
   public:
    explicit Buffer(std::streambuf& to) : to_(to) {}
    const std::string& text() const { return text_; }

   private:
    int_type overflow(int_type character) override;
    std::streamsize xsputn(const char* text, std::streamsize size) override;
    int sync() override { return to_.pubsync(); }

    static constexpr std::size_t kMost = 65'536;  // of a command that runs for long
    std::streambuf& to_;
    std::string text_;
  };

  Buffer buffer_;
};

}  // namespace linegate::gateway
