// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/words.h"

#include <charconv>
#include <sstream>

namespace linegate::plant {
namespace {

std::uint64_t parse(std::string_view digits, int base, std::string_view whole) {
  std::uint64_t value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [rest, error] = std::from_chars(digits.data(), end, value, base);
  if (error != std::errc{} || rest != end || digits.empty()) {
    throw BadStatement("'" + std::string(whole) + "' is not a number");
  }
  return value;
}

}  // namespace

std::vector<std::byte> pattern(std::uint64_t size) {
  std::vector<std::byte> out(size);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::byte>(i * 7 + i / 256 + size);
  }
  return out;
}

std::uint64_t to_number(std::string_view text) {
  return text.starts_with("0x") ? parse(text.substr(2), 16, text) : parse(text, 10, text);
}

Duration to_duration(std::string_view text) {
  const std::size_t unit = text.find_first_not_of("0123456789");
  const auto value = static_cast<std::int64_t>(parse(text.substr(0, unit), 10, text));
  const std::string_view name = unit == std::string_view::npos ? "" : text.substr(unit);
  if (name == "us") {
    return std::chrono::microseconds(value);
  }
  if (name == "ms") {
    return std::chrono::milliseconds(value);
  }
  if (name == "s") {
    return std::chrono::seconds(value);
  }
  throw BadStatement("'" + std::string(text) + "' is not a time: 100us, 10ms, 2s");
}

od::Address parse_address(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) {
    throw BadStatement("'" + std::string(text) + "' is not index:sub");
  }
  return {static_cast<std::uint16_t>(parse(text.substr(0, colon), 16, text)),
          static_cast<std::uint8_t>(parse(text.substr(colon + 1), 10, text))};
}

Words::Words(std::string_view statement) {
  std::istringstream in{std::string(statement.substr(0, statement.find('#')))};
  for (std::string word; in >> word;) {
    words_.push_back(word);
  }
}

const std::string& Words::peek() const {
  static const std::string kNothing;
  return done() ? kNothing : words_[next_];
}

std::string Words::take() {
  if (done()) {
    throw BadStatement("the statement ends too early");
  }
  return words_[next_++];
}

bool Words::accept(std::string_view word) {
  const bool is = peek() == word;
  next_ += is ? 1 : 0;
  return is;
}

void Words::expect(std::string_view word) {
  if (!accept(word)) {
    throw BadStatement("'" + std::string(word) + "' expected, not '" + peek() + "'");
  }
}

std::uint64_t Words::number() {
  return to_number(take());
}

std::uint8_t Words::node() {
  if (accept("all")) {
    return 0;
  }
  const std::uint64_t id = number();
  if (id > 127) {
    throw BadStatement("there is no node " + std::to_string(id));
  }
  return static_cast<std::uint8_t>(id);
}

Duration Words::duration() {
  return to_duration(take());
}

od::Address Words::address() {
  return parse_address(take());
}

std::vector<std::byte> Words::hex() {
  const std::string text = take();
  if (text.size() % 2 != 0) {
    throw BadStatement("'" + text + "' is not whole bytes");
  }
  std::vector<std::byte> out;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    out.push_back(static_cast<std::byte>(parse(std::string_view(text).substr(i, 2), 16, text)));
  }
  return out;
}

}  // namespace linegate::plant
