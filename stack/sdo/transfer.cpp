// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/transfer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "stack/base/assert.h"
#include "stack/od/hook.h"

namespace linegate::sdo {
namespace {

// An indicated size may be wrong: memory beyond this is allocated only as the bytes arrive.
constexpr std::size_t kMaxReserve = std::size_t{64} * 1024;

}  // namespace

// --- source -------------------------------------------------------------------------------------

void Source::start(std::span<const std::byte> value) {
  bytes_.assign(value.begin(), value.end());
  from_ = nullptr;
  begin();
}

void Source::start(std::vector<std::byte>&& value) {
  bytes_ = std::move(value);
  from_ = nullptr;
  begin();
}

void Source::start(od::ByteSource& from) {
  from_ = &from;
  begin();
}

void Source::begin() {
  begin_ = 0;
  released_ = 0;
  position_ = 0;
  error_ = AbortCode::none;
  ended_ = from_ == nullptr;
  if (from_ != nullptr) {
    bytes_.clear();
    bytes_.reserve(kWindow);
  }
}

std::optional<std::uint32_t> Source::size() const {
  return from_ == nullptr ? static_cast<std::uint32_t>(bytes_.size()) : from_->size();
}

// One byte of look-ahead shows whether these are the last.
std::size_t Source::next(std::span<std::byte> out) {
  LINEGATE_ASSERT_HOT(out.size() <= 64, "a frame takes up to 64 bytes");
  LINEGATE_ASSERT_HOT(from_ == nullptr || position_ - released_ <= kRewind,
                      "data that may be repeated fits into the window");
  error_ = error_ == od::kLater ? AbortCode::none : error_;
  if (!ended_ && position_ + out.size() >= begin_ + bytes_.size()) {
    fill();
    if (error_ == od::kLater) {
      return 0;
    }
  }
  const std::size_t offset = position_ - begin_;
  const std::size_t count = std::min(out.size(), bytes_.size() - offset);
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), count, out.begin());
  std::ranges::fill(out.subspan(count), std::byte{0});
  position_ += count;
  return count;
}

void Source::fill() {
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(released_ - begin_));
  begin_ = released_;
  const std::size_t kept = bytes_.size();
  const std::optional<std::uint32_t> size = from_->size();
  const std::size_t left = size ? *size - std::min<std::size_t>(*size, begin_ + kept) : kWindow;
  const std::size_t wanted = std::min(kWindow - kept, left);
  bytes_.resize(kept + wanted);
  std::size_t got = 0;
  if (wanted > 0) {
    const Result<std::size_t> read = from_->read(std::span(bytes_).subspan(kept));
    got = read.ok() ? std::min(*read, wanted) : 0;
    error_ = read.ok() ? AbortCode::none : static_cast<AbortCode>(read.error().code);
  }
  bytes_.resize(kept + got);
  if (error_ == od::kLater) {
    return;
  }
  ended_ = got < wanted || (size && wanted == left);
  if (size && got < wanted && error_ == AbortCode::none) {
    error_ = AbortCode::no_data;
  }
}

bool Source::restart() {
  if (from_ != nullptr && !from_->rewind()) {
    return false;
  }
  begin();
  return true;
}

void Source::close(AbortCode why) {
  if (from_ != nullptr) {
    std::exchange(from_, nullptr)->closed(why);
  }
}

// --- sink ---------------------------------------------------------------------------------------

void Sink::start(std::optional<std::uint32_t> announced, std::size_t limit, AbortCode over_limit) {
  to_ = nullptr;
  streams_ = false;
  bytes_.clear();
  received_ = 0;
  announced_ = announced;
  limit_ = limit;
  over_limit_ = over_limit;
  if (announced) {
    bytes_.reserve(std::min({std::size_t{*announced}, limit, kMaxReserve}));
  }
}

void Sink::start(std::optional<std::uint32_t> announced, od::ByteSink& to) {
  start(std::nullopt, std::numeric_limits<std::uint32_t>::max(), AbortCode::out_of_memory);
  announced_ = announced;
  to_ = &to;
  streams_ = true;
  bytes_.reserve(kPiece);
}

AbortCode Sink::append(std::span<const std::byte> piece) {
  const std::size_t size = received_ + piece.size();
  if (announced_ && size > *announced_) {
    return AbortCode::length_too_high;
  }
  if (size > limit_) {
    return over_limit_;
  }
  AbortCode why = AbortCode::none;
  if (to_ != nullptr && bytes_.size() + piece.size() > kPiece) {
    why = pass_on();
    if (why != AbortCode::none && why != od::kLater) {
      return why;
    }
  }
  received_ = size;
  bytes_.insert(bytes_.end(), piece.begin(), piece.end());
  return why;
}

AbortCode Sink::pass_on() {
  const AbortCode why = to_->write(bytes_);
  bytes_.clear();
  return why;
}

AbortCode Sink::finish() {
  if (announced_ && received_ < *announced_) {
    return AbortCode::length_too_low;
  }
  if (to_ == nullptr) {
    return AbortCode::none;
  }
  const AbortCode why = bytes_.empty() ? AbortCode::none : pass_on();
  if (to_ == nullptr) {
    return AbortCode::general;  // the stream reset its node, which cancelled the transfer
  }
  return why == AbortCode::none ? std::exchange(to_, nullptr)->finish() : why;
}

void Sink::cancel(AbortCode why) {
  if (to_ != nullptr) {
    std::exchange(to_, nullptr)->cancelled(why);
  }
}

std::vector<std::byte> Sink::take() {
  return std::exchange(bytes_, {});
}

}  // namespace linegate::sdo
