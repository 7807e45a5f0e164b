// SPDX-License-Identifier: Apache-2.0
// A transfer source for shared bytes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "stack/od/stream.h"

namespace linegate::manager {

using SharedBytes = std::shared_ptr<const std::vector<std::byte>>;

class SharedSource final : public od::ByteSource {
 public:
  // bytes: not nullptr.
  explicit SharedSource(SharedBytes bytes) : bytes_(std::move(bytes)) {}

  // Number of bytes that the receiver acknowledged.
  std::size_t acknowledged() const { return acknowledged_; }

  std::optional<std::uint32_t> size() const override {
    return static_cast<std::uint32_t>(bytes_->size());
  }
  Result<std::size_t> read(std::span<std::byte> out) override {
    const std::size_t count = std::min(out.size(), bytes_->size() - position_);
    std::copy_n(bytes_->begin() + static_cast<std::ptrdiff_t>(position_), count, out.begin());
    position_ += count;
    return count;
  }
  bool rewind() override {
    position_ = 0;
    acknowledged_ = 0;
    return true;
  }
  void acknowledged(std::size_t count) override { acknowledged_ = count; }
  void closed(AbortCode /*why*/) override { closed_ = true; }
  // The transfer has ended.
  bool is_closed() const { return closed_; }

 private:
  SharedBytes bytes_;
  std::size_t position_ = 0;
  std::size_t acknowledged_ = 0;
  bool closed_ = false;
};

}  // namespace linegate::manager
