#include "stack/sdo/transfer.h"

#include <algorithm>
#include <utility>

namespace linegate::sdo {
namespace {

// A size on the wire is only a claim: room for more than this is made when the bytes are there.
constexpr std::size_t kMaxReserve = std::size_t{64} * 1024;

}  // namespace

void Source::start(std::span<const std::byte> value) {
  bytes_.assign(value.begin(), value.end());
  position_ = 0;
}

void Source::start(std::vector<std::byte>&& value) {
  bytes_ = std::move(value);
  position_ = 0;
}

std::size_t Source::next(std::span<std::byte> out) {
  const std::size_t count = std::min(out.size(), remaining());
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(position_), count, out.begin());
  std::ranges::fill(out.subspan(count), std::byte{0});
  position_ += count;
  return count;
}

void Sink::start(std::optional<std::uint32_t> announced, std::size_t limit, AbortCode over_limit) {
  bytes_.clear();
  announced_ = announced;
  limit_ = limit;
  over_limit_ = over_limit;
  if (announced) {
    bytes_.reserve(std::min({std::size_t{*announced}, limit, kMaxReserve}));
  }
}

AbortCode Sink::append(std::span<const std::byte> piece) {
  const std::size_t size = bytes_.size() + piece.size();
  if (announced_ && size > *announced_) {
    return AbortCode::length_too_high;
  }
  if (size > limit_) {
    return over_limit_;
  }
  bytes_.insert(bytes_.end(), piece.begin(), piece.end());
  return AbortCode::none;
}

AbortCode Sink::finish() const {
  return announced_ && bytes_.size() < *announced_ ? AbortCode::length_too_low : AbortCode::none;
}

std::vector<std::byte> Sink::take() {
  return std::exchange(bytes_, {});
}

}  // namespace linegate::sdo
