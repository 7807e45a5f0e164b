// SPDX-License-Identifier: Apache-2.0
// Fields one behind the other, little-endian, as data of commands and replies have them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"

namespace linegate::request {

class FieldWriter {
 public:
  // size: 1..8 bytes.
  void number(std::uint64_t value, std::size_t size) {
    out_.resize(out_.size() + size);
    store_le(std::span(out_).last(size), value);
  }
  void bytes(std::span<const std::byte> value) {
    out_.insert(out_.end(), value.begin(), value.end());
  }
  // Its length before, in a number of that many bytes.
  void sized(std::span<const std::byte> value, std::size_t size) {
    number(value.size(), size);
    bytes(value);
  }
  void sized(std::string_view text, std::size_t size) {
    sized(std::as_bytes(std::span(text)), size);
  }
  std::vector<std::byte> take() { return std::move(out_); }

 private:
  std::vector<std::byte> out_;
};

// From the front. Beyond the end there are 0 and nothing, and good() is false.
class FieldReader {
 public:
  explicit FieldReader(std::span<const std::byte> data) : rest_(data) {}

  template <class Number>
  Number number(std::size_t size = sizeof(Number)) {
    return static_cast<Number>(load_le(raw(size)));
  }
  std::span<const std::byte> raw(std::size_t size) {
    good_ = good_ && size <= rest_.size();
    const auto out = good_ ? rest_.first(size) : std::span<const std::byte>();
    rest_ = rest_.subspan(out.size());
    return out;
  }
  // With its length before.
  std::vector<std::byte> sized(std::size_t size) {
    const auto value = raw(number<std::size_t>(size));
    return {value.begin(), value.end()};
  }
  std::string text(std::size_t size) {
    const auto value = raw(number<std::size_t>(size));
    return {reinterpret_cast<const char*>(value.data()), value.size()};
  }

  // The bytes are malformed unless the condition holds.
  void require(bool condition) { good_ = good_ && condition; }

  bool good() const { return good_; }
  std::size_t left() const { return rest_.size(); }
  bool complete() const { return good_ && rest_.empty(); }

 private:
  std::span<const std::byte> rest_;
  bool good_ = true;
};

}  // namespace linegate::request
