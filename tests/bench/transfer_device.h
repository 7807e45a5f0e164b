// SPDX-License-Identifier: Apache-2.0
// The device for measurements of SDO transfers: a value of 32 bits, and a DOMAIN of any size that
// is not stored: its bytes follow from their offset, and are compared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/od/description.h"
#include "stack/od/hook.h"
#include "stack/od/stream.h"

namespace linegate::bench {

inline constexpr od::Address kValue{0x2000, 0};
inline constexpr od::Address kDomain{0x2001, 0};

inline od::DeviceDescription transfer_device() {
  od::DeviceDescription out;
  od::ObjectDescription value{
      .index = kValue.index, .name = "Value", .type = od::ObjectType::variable};
  value.variables.push_back(
      {.sub = 0, .name = "Value", .type = od::DataType::unsigned32, .access = od::Access::rw});
  od::ObjectDescription domain{
      .index = kDomain.index, .name = "Domain", .type = od::ObjectType::domain};
  domain.variables.push_back(
      {.sub = 0, .name = "Domain", .type = od::DataType::domain, .access = od::Access::rw});
  out.objects = {value, domain};
  return out;
}

inline std::byte pattern(std::uint32_t at) {
  return static_cast<std::byte>(at * 2'654'435'761U >> 24U);
}

class PatternSource final : public od::ByteSource {
 public:
  // tells_size: whether the size is indicated. An upload of unknown size uses segments.
  explicit PatternSource(std::uint32_t bytes, bool tells_size = true)
      : bytes_(bytes), tells_size_(tells_size) {}

  std::optional<std::uint32_t> size() const override {
    return tells_size_ ? std::optional(bytes_) : std::nullopt;
  }
  Result<std::size_t> read(std::span<std::byte> out) override {
    std::size_t given = 0;
    while (given < out.size() && at_ < bytes_) {
      out[given++] = pattern(at_++);
    }
    return given;
  }
  bool rewind() override {
    at_ = 0;
    return true;
  }

 private:
  std::uint32_t bytes_;
  bool tells_size_;
  std::uint32_t at_ = 0;
};

class PatternSink final : public od::ByteSink {
 public:
  explicit PatternSink(std::uint32_t bytes) : bytes_(bytes) {}

  AbortCode write(std::span<const std::byte> piece) override {
    for (const std::byte byte : piece) {
      right_ = right_ && at_ < bytes_ && byte == pattern(at_++);
    }
    return AbortCode::none;
  }
  AbortCode finish() override {
    complete_ = right_ && at_ == bytes_;
    return AbortCode::none;
  }
  bool rewind() override {
    at_ = 0;
    right_ = true;
    return true;
  }
  // Whether all bytes were received and are right.
  bool complete() const { return complete_; }

 private:
  std::uint32_t bytes_;
  std::uint32_t at_ = 0;
  bool right_ = true;
  bool complete_ = false;
};

// The server's end: each transfer has its own stream.
class PatternDomain final : public od::Hook {
 public:
  explicit PatternDomain(std::uint32_t bytes, bool tells_size = true)
      : bytes_(bytes), tells_size_(tells_size) {}

  Result<od::ByteSource*> open_source(od::Address /*address*/) override {
    source_.emplace(bytes_, tells_size_);
    return &*source_;
  }
  Result<od::ByteSink*> open_sink(od::Address /*address*/,
                                  std::optional<std::uint32_t> /*size*/) override {
    sink_.emplace(bytes_);
    return &*sink_;
  }
  bool complete() const { return sink_ && sink_->complete(); }

 private:
  std::uint32_t bytes_;
  bool tells_size_;
  std::optional<PatternSource> source_;
  std::optional<PatternSink> sink_;
};

}  // namespace linegate::bench
