// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/candump.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>

#include <linux/can/error.h>

#include "bridges/can/error_frame.h"
#include "bridges/can/frame_codec.h"
#include "bridges/can/sendable.h"

namespace linegate::can_bridge {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::string_view kLost = "DROPCOUNT: dropped ";
constexpr std::string_view kHex = "0123456789ABCDEF";

// Reads a line from left to right and counts columns for error messages.
class Cursor {
 public:
  explicit Cursor(std::string_view line) : line_(line) {}

  bool at_end() const { return at_ == line_.size(); }
  char peek() const { return at_end() ? '\0' : line_[at_]; }
  bool skip(char wanted) {
    if (peek() != wanted || at_end()) {
      return false;
    }
    ++at_;
    return true;
  }
  void skip_blanks() {
    while (skip(' ')) {
    }
  }
  // Returns the text up to the first unwanted character.
  template <class Wanted>
  std::string_view take(Wanted wanted) {
    const std::size_t begin = at_;
    while (!at_end() && wanted(line_[at_])) {
      ++at_;
    }
    return line_.substr(begin, at_ - begin);
  }
  std::string_view word() {
    return take([](char c) { return c != ' '; });
  }
  bool wrong(LogProblem& problem, std::string_view text) const {
    problem = {static_cast<std::uint32_t>(at_ + 1), text};
    return false;
  }

 private:
  std::string_view line_;
  std::size_t at_ = 0;
};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::optional<unsigned> hex_digit(char c) {
  if (is_digit(c)) {
    return static_cast<unsigned>(c - '0');
  }
  if (c >= 'A' && c <= 'F') {
    return static_cast<unsigned>(c - 'A' + 10);
  }
  if (c >= 'a' && c <= 'f') {
    return static_cast<unsigned>(c - 'a' + 10);
  }
  return std::nullopt;
}

bool is_hex(char c) {
  return hex_digit(c).has_value();
}

bool parse_stamp(Cursor& at, std::int64_t& stamp, LogProblem& problem) {
  // Digits: a time stamp then fits into 63 bits until the year 2262
  constexpr std::size_t kLongest = 9;
  if (!at.skip('(')) {
    return at.wrong(problem, "expected the time in parentheses");
  }
  const std::string_view seconds = at.take(is_digit);
  if (seconds.empty() || seconds.size() > kLongest + 1 || !at.skip('.')) {
    return at.wrong(problem, "expected a time as (seconds.microseconds)");
  }
  const std::string_view fraction = at.take(is_digit);
  if (fraction.empty() || fraction.size() > kLongest || !at.skip(')')) {
    return at.wrong(problem, "expected a time as (seconds.microseconds)");
  }
  std::int64_t whole = 0;
  std::int64_t part = 0;
  std::from_chars(seconds.data(), seconds.data() + seconds.size(), whole);
  std::from_chars(fraction.data(), fraction.data() + fraction.size(), part);
  for (std::size_t i = fraction.size(); i < kLongest; ++i) {
    part *= 10;
  }
  if (whole > INT64_MAX / kSecond - 1) {
    return at.wrong(problem, "a time after the year 2261");
  }
  stamp = whole * kSecond + part;
  return true;
}

bool parse_identifier(Cursor& at, std::uint32_t& id, bool& extended, LogProblem& problem) {
  constexpr std::size_t kShort = 3;
  constexpr std::size_t kLong = 8;
  const Cursor begin = at;
  const std::string_view digits = at.take(is_hex);
  if ((digits.size() != kShort && digits.size() != kLong) || at.peek() != '#') {
    return begin.wrong(problem, "expected an identifier of 3 or 8 hexadecimal digits and #");
  }
  std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
  extended = digits.size() == kLong;
  const std::uint32_t highest = extended ? CAN_ERR_FLAG | CAN_EFF_MASK : CAN_SFF_MASK;
  if (id > highest) {
    return begin.wrong(problem, "there is no such identifier");
  }
  at.skip('#');
  return true;
}

// Pairs of hexadecimal digits. A point between pairs is permitted, as in cansend.
bool parse_data(Cursor& at, can::Frame& frame, std::size_t most, LogProblem& problem) {
  std::size_t count = 0;
  while (const auto high = hex_digit(at.peek())) {
    const Cursor begin = at;
    at.skip(at.peek());
    const auto low = hex_digit(at.peek());
    if (!low) {
      return at.wrong(problem, "expected the second hexadecimal digit of a byte");
    }
    if (count == most) {
      return begin.wrong(problem, "more data than such a frame has");
    }
    at.skip(at.peek());
    frame.data[count++] = static_cast<std::byte>(*high << 4U | *low);
    at.skip('.');
  }
  frame.length = static_cast<std::uint8_t>(count);
  return true;
}

bool parse_remote(Cursor& at, can::Frame& frame, LogProblem& problem) {
  frame.flags |= can::Frame::kRemote;
  if (is_digit(at.peek())) {
    frame.length = static_cast<std::uint8_t>(at.peek() - '0');
    if (frame.length > can::kMaxClassicData) {
      return at.wrong(problem, "a remote frame requests 8 bytes at most");
    }
    at.skip(at.peek());
  }
  return true;
}

bool parse_fd(Cursor& at, can::Frame& frame, LogProblem& problem) {
  const auto flags = hex_digit(at.peek());
  if (!flags) {
    return at.wrong(problem, "expected a digit of flags after ##");
  }
  at.skip(at.peek());
  frame.flags |= can::Frame::kFd;
  if ((*flags & CANFD_BRS) != 0) {
    frame.flags |= can::Frame::kBitRateSwitch;
  }
  if ((*flags & CANFD_ESI) != 0) {
    frame.flags |= can::Frame::kErrorStateIndicator;
  }
  const Cursor begin = at;
  if (!parse_data(at, frame, can::kMaxFdData, problem)) {
    return false;
  }
  return can::fd_length(frame.length) == frame.length ||
         begin.wrong(problem, "a length that CAN FD does not have");
}

bool parse_content(Cursor& at, can::Frame& frame, LogProblem& problem) {
  if (at.skip('#')) {
    return at.peek() == '#' ? at.wrong(problem, "CAN XL frames are not read")
                            : parse_fd(at, frame, problem);
  }
  if (at.skip('R')) {
    return parse_remote(at, frame, problem);
  }
  if (!parse_data(at, frame, can::kMaxClassicData, problem)) {
    return false;
  }
  // "_9" to "_F": the raw DLC of a classical frame with 8 bytes (candump -8).
  if (frame.length == can::kMaxClassicData && at.skip('_') && !at.skip(at.peek())) {
    return at.wrong(problem, "expected a length code after _");
  }
  return true;
}

bool parse_frame(Cursor& at, LogEntry& out, LogProblem& problem) {
  std::uint32_t id = 0;
  bool extended = false;
  out.frame.flags = 0;
  out.frame.length = 0;
  const Cursor begin = at;
  if (!parse_identifier(at, id, extended, problem) || !parse_content(at, out.frame, problem)) {
    return false;
  }
  out.kind = LogEntry::Kind::frame;
  out.frame.id = id;
  if (extended) {
    out.frame.flags |= can::Frame::kExtended;
  }
  if ((id & CAN_ERR_FLAG) != 0) {
    if (out.frame.length != CAN_ERR_DLC || out.frame.fd() || out.frame.remote()) {
      return begin.wrong(problem, "an error frame has 8 bytes");
    }
    out.kind = LogEntry::Kind::error_frame;
    out.error = {};
    out.error.can_id = id;
    out.error.len = CAN_ERR_DLC;
    std::memcpy(out.error.data, out.frame.data.data(), CAN_ERR_DLC);
  }
  return true;
}

bool parse_lost(Cursor at, std::string_view line, LogEntry& out, LogProblem& problem) {
  const std::string_view count = line.substr(kLost.size());
  const auto read = std::from_chars(count.data(), count.data() + count.size(), out.lost);
  if (read.ec != std::errc{}) {
    return at.wrong(problem, "expected how many frames were dropped");
  }
  out.kind = LogEntry::Kind::frames_lost;
  out.interface = {};
  const std::size_t begin = line.find('\'');
  const std::size_t end = begin == std::string_view::npos ? begin : line.find('\'', begin + 1);
  if (end != std::string_view::npos) {
    out.interface = line.substr(begin + 1, end - begin - 1);
  }
  return true;
}

// --- writing ------------------------------------------------------------------------------------

class Writer {
 public:
  explicit Writer(std::span<char> out) : out_(out) {}

  Writer& text(std::string_view value) {
    std::memcpy(out_.data() + at_, value.data(), value.size());
    at_ += value.size();
    return *this;
  }
  Writer& number(std::uint64_t value, std::size_t digits = 1) {
    std::array<char, 20> reversed{};
    std::size_t count = 0;
    do {
      reversed[count++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0);
    for (std::size_t i = count; i < digits; ++i) {
      out_[at_++] = '0';
    }
    while (count > 0) {
      out_[at_++] = reversed[--count];
    }
    return *this;
  }
  Writer& hex(std::uint32_t value, unsigned digits) {
    for (unsigned i = digits; i > 0; --i) {
      out_[at_++] = kHex[value >> (4 * (i - 1)) & 0xFU];
    }
    return *this;
  }
  Writer& hex(std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) {
      hex(std::to_integer<std::uint32_t>(byte), 2);
    }
    return *this;
  }
  Writer& head(std::int64_t stamp_ns, std::string_view interface) {
    const std::int64_t stamp = std::max<std::int64_t>(stamp_ns, 0);
    text("(").number(static_cast<std::uint64_t>(stamp / kSecond), 10).text(".");
    number(static_cast<std::uint64_t>(stamp % kSecond / 1000), 6).text(") ");
    return text(interface.substr(0, 64)).text(" ");
  }
  std::size_t size() const { return at_; }

 private:
  std::span<char> out_;
  std::size_t at_ = 0;
};

}  // namespace

bool parse_log_line(std::string_view line, LogEntry& out, LogProblem& problem) {
  out.kind = LogEntry::Kind::remark;
  out.stamp_ns = 0;
  if (!line.empty() && line.back() == '\r') {
    line.remove_suffix(1);
  }
  Cursor at(line);
  if (line.starts_with(kLost)) {
    return parse_lost(at, line, out, problem);
  }
  at.skip_blanks();
  if (at.peek() != '(') {
    return at.at_end() || at.peek() == '#' ||
           at.wrong(problem, "expected a line of candump -L: (seconds.microseconds) can0 181#01");
  }
  if (!parse_stamp(at, out.stamp_ns, problem)) {
    return false;
  }
  at.skip_blanks();
  out.interface = at.word();
  at.skip_blanks();
  if (at.at_end()) {
    return at.wrong(problem, "expected an interface and a frame after the time");
  }
  if (!parse_frame(at, out, problem)) {
    return false;
  }
  at.skip_blanks();
  if (at.peek() == 'R' || at.peek() == 'T') {  // candump -x: received or sent
    at.skip(at.peek());
    at.skip_blanks();
  }
  return at.at_end() || at.wrong(problem, "nothing is expected after the frame");
}

std::size_t format_log_line(std::span<char> out, std::int64_t stamp_ns, std::string_view interface,
                            const can::Frame& frame) {
  Writer to(out);
  to.head(stamp_ns, interface).hex(frame.id, frame.extended() ? 8 : 3).text("#");
  if (frame.fd()) {
    const std::uint32_t brs = (frame.flags & can::Frame::kBitRateSwitch) != 0 ? CANFD_BRS : 0;
    const std::uint32_t esi = (frame.flags & can::Frame::kErrorStateIndicator) != 0 ? CANFD_ESI : 0;
    to.text("#").hex(brs | esi | CANFD_FDF, 1).hex(frame.bytes());
  } else if (frame.remote()) {
    to.text("R");
    if (frame.length > 0) {
      to.number(frame.length);
    }
  } else {
    to.hex(frame.bytes());
  }
  return to.text("\n").size();
}

std::size_t format_log_line(std::span<char> out, std::int64_t stamp_ns, std::string_view interface,
                            const can::BusEvent& event) {
  canfd_frame raw{};
  if (!encode_error(event, raw)) {
    return 0;
  }
  Writer to(out);
  to.head(stamp_ns, interface).hex(raw.can_id, 8).text("#");
  return to.hex(std::as_bytes(std::span(raw.data).first(CAN_ERR_DLC))).text("\n").size();
}

std::size_t format_lost(std::span<char> out, std::string_view interface, std::uint64_t lost,
                        std::uint64_t total) {
  Writer to(out);
  to.text(kLost).number(lost).text(lost == 1 ? " CAN frame on '" : " CAN frames on '");
  return to.text(interface.substr(0, 64))
      .text("' socket (total drops ")
      .number(total)
      .text(")\n")
      .size();
}

}  // namespace linegate::can_bridge
