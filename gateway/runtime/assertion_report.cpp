// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/assertion_report.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>

#include <unistd.h>

#include "stack/base/assert.h"
#include "stack/base/event.h"
#include "stack/base/event_members.h"

namespace linegate::gateway {
namespace {

// The text of one line of output; text beyond its end is cut off.
class Output {
 public:
  Output& operator<<(std::string_view text) {
    const std::size_t size = std::min(text.size(), buffer_.size() - used_);
    std::copy_n(text.begin(), size, buffer_.begin() + used_);
    used_ += size;
    return *this;
  }
  Output& operator<<(std::uint64_t number) {
    std::array<char, 20> digits;
    const auto end = std::to_chars(digits.begin(), digits.end(), number).ptr;
    return *this << std::string_view(digits.begin(), end);
  }
  void print() {
    buffer_[std::min(used_++, buffer_.size() - 1)] = '\n';
    for (std::string_view left(buffer_.begin(), std::min(used_, buffer_.size())); !left.empty();) {
      const ssize_t written = write(STDERR_FILENO, left.data(), left.size());
      if (written <= 0) {
        break;
      }
      left.remove_prefix(static_cast<std::size_t>(written));
    }
    used_ = 0;
  }

 private:
  std::array<char, 1024> buffer_;
  std::size_t used_ = 0;
};

class MemberPrinter final : public EventMemberVisitor {
 public:
  explicit MemberPrinter(Output& out) : out_(out) {}

  void number(std::string_view name, std::uint64_t value) override {
    out_ << ", " << name << " " << value;
  }
  void bytes(std::string_view name, std::span<const std::byte> value) override {
    out_ << ", " << name;
    for (const std::byte b : value) {
      out_ << " " << std::to_integer<std::uint64_t>(b);
    }
  }

 private:
  Output& out_;
};

void print(Output& out, const Event& event) {
  const auto time =
      std::chrono::duration_cast<std::chrono::milliseconds>(event.time.time_since_epoch());
  MemberPrinter members(out);
  out << "  event " << event.number << " " << name(event.kind()) << ", node "
      << std::uint64_t{event.node};
  visit_members(event.data, members);
  out << ", at " << static_cast<std::uint64_t>(time.count()) << " ms";
  out.print();
}

void print_violated(const Assertion& assertion) {
  Output out;
  out << "assertion violated: " << assertion.text << " (" << assertion.expression << "), "
      << assertion.file << ":" << static_cast<std::uint64_t>(assertion.line);
  out.print();
  // Reading the events may violate another assertion, which then ends the process at once.
  const line::Line* const line = RunningLine::forget();
  if (line == nullptr) {
    return;
  }
  std::array<Event, RunningLine::kEvents> events{};
  const std::size_t count = line->newest_events(events);
  out << "on the line " << line->config().name << ", last events:";
  out.print();
  for (const Event& event : std::span(events).first(count)) {
    print(out, event);
  }
}

}  // namespace

void report_assertions() {
  set_assertion_handler(print_violated);
}

}  // namespace linegate::gateway
