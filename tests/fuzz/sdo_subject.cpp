// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/sdo_subject.h"

#include <algorithm>
#include <utility>

namespace linegate::fuzz {
namespace {

od::ObjectDescription object(std::uint16_t index, od::DataType type, od::Access access,
                             std::vector<std::byte> value) {
  od::VariableDescription variable;
  variable.type = type;
  variable.access = access;
  variable.value = std::move(value);
  od::ObjectDescription out;
  out.index = index;
  out.variables.push_back(std::move(variable));
  return out;
}

}  // namespace

od::DeviceDescription sdo_device() {
  od::DeviceDescription out;
  out.objects.push_back(object(0x1000, od::DataType::unsigned32, od::Access::ro,
                               {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}}));
  out.objects.push_back(object(0x2000, od::DataType::unsigned8, od::Access::rw, {}));
  out.objects.back().variables[0].high_limit = {std::byte{100}};
  out.objects.push_back(object(0x2001, od::DataType::unsigned64, od::Access::rw, {}));
  out.objects.push_back(object(0x2002, od::DataType::visible_string, od::Access::rw, {}));
  out.objects.push_back(object(0x2003, od::DataType::domain, od::Access::rw, {}));
  out.objects.push_back(object(0x2004, od::DataType::unsigned32, od::Access::wo, {}));
  out.objects.push_back(object(kStream, od::DataType::domain, od::Access::rw, {}));
  out.objects.push_back(object(kSlowStream, od::DataType::domain, od::Access::rw, {}));
  out.objects.push_back(object(kSlowValue, od::DataType::unsigned32, od::Access::rw, {}));
  return out;
}

// --- streams ------------------------------------------------------------------------------------

Result<std::size_t> PatternSource::read(std::span<std::byte> out) {
  LINEGATE_EXPECT(!over_ && !out.empty());
  if (delays_ != nullptr && delays_->later()) {
    return to_error(od::kLater);
  }
  std::size_t count = 0;
  for (; count < out.size() && position_ < size_; ++count) {
    out[count] = pattern_byte(position_++);
  }
  return count;
}

bool PatternSource::rewind() {
  LINEGATE_EXPECT(!over_);
  position_ = 0;
  return true;
}

void PatternSource::closed(AbortCode why) {
  LINEGATE_EXPECT(!std::exchange(over_, true));
  LINEGATE_EXPECT(why != AbortCode::none || position_ == size_);
}

AbortCode PatternSink::write(std::span<const std::byte> piece) {
  LINEGATE_EXPECT(!over_ && !piece.empty());
  for (const std::byte b : piece) {
    right_ = right_ && b == pattern_byte(position_++);
  }
  return delays_ != nullptr && delays_->later() ? od::kLater : AbortCode::none;
}

AbortCode PatternSink::finish() {
  LINEGATE_EXPECT(!std::exchange(over_, true));
  finished_ = true;
  return delays_ != nullptr && delays_->later() ? od::kLater : AbortCode::none;
}

void PatternSink::cancelled(AbortCode why) {
  LINEGATE_EXPECT(!std::exchange(over_, true));
  LINEGATE_EXPECT(why != AbortCode::none && why != od::kLater);
}

bool PatternSink::rewind() {
  LINEGATE_EXPECT(!over_);
  position_ = 0;
  right_ = true;
  return true;
}

// --- the hook -----------------------------------------------------------------------------------

SdoObjects::SdoObjects(od::Dictionary& dictionary) : dictionary_(dictionary) {
  for (const std::uint16_t index : {kStream, kSlowStream, kSlowValue}) {
    LINEGATE_EXPECT(dictionary.set_hook(index, this).ok());
  }
}

void SdoObjects::answer(std::uint8_t which, bool good) {
  if (waiting_.empty()) {
    return;
  }
  const auto at = waiting_.begin() + which % static_cast<std::ptrdiff_t>(waiting_.size());
  const od::Ticket ticket = *at;
  waiting_.erase(at);
  const AbortCode answer = good ? AbortCode::none : AbortCode::hardware;
  LINEGATE_EXPECT(dictionary_.complete(ticket, answer));
  LINEGATE_EXPECT(!dictionary_.complete(ticket, answer));
}

bool SdoObjects::at_rest() const {
  const auto over = [](const auto& stream) { return stream.over(); };
  return waiting_.empty() && std::ranges::all_of(sources_, over) &&
         std::ranges::all_of(sinks_, over);
}

AbortCode SdoObjects::before_read(od::Address address, const od::Variable& /*variable*/) {
  return address.index == kSlowValue ? od::kLater : AbortCode::none;
}

AbortCode SdoObjects::check_write(od::Address address, std::span<const std::byte> /*value*/) {
  LINEGATE_EXPECT(address.index == kSlowValue);
  return od::kLater;
}

Result<od::ByteSource*> SdoObjects::open_source(od::Address address) {
  Delays* delays = delays_of(address);
  if (delays != nullptr && delays->later()) {
    return to_error(od::kLater);
  }
  constexpr std::uint32_t kSizes[] = {0, 3, 7, 40, 62, 889, 900, 2048, 5000};
  const std::uint32_t size = kSizes[opened_ % std::size(kSizes)];
  sources_.emplace_back(size, opened_++ % 2 == 0, delays);
  last_[server_].source = &sources_.back();
  return static_cast<od::ByteSource*>(&sources_.back());
}

Result<od::ByteSink*> SdoObjects::open_sink(od::Address address,
                                            std::optional<std::uint32_t> /*size*/) {
  Delays* delays = delays_of(address);
  if (delays != nullptr && delays->later()) {
    return to_error(od::kLater);
  }
  sinks_.emplace_back(delays);
  last_[server_].sink = &sinks_.back();
  return static_cast<od::ByteSink*>(&sinks_.back());
}

void SdoObjects::put_off(od::Address /*address*/, od::Ticket ticket) {
  LINEGATE_EXPECT(ticket != 0);
  waiting_.push_back(ticket);
}

void SdoObjects::cancelled(od::Ticket ticket) {
  LINEGATE_EXPECT(std::erase(waiting_, ticket) == 1);
}

}  // namespace linegate::fuzz
