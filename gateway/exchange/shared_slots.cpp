// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/shared_slots.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <system_error>

#include "stack/base/assert.h"

namespace linegate::exchange {
namespace {

// Each series begins at a page, each slot at a cache line.
constexpr std::size_t kPage = 4'096;

std::size_t rounded(std::size_t bytes, std::size_t to) {
  return (bytes + to - 1) / to * to;
}

SlotPlaces::Sizes strides(SlotPlaces::Sizes longest, std::size_t length_bytes) {
  for (std::size_t& size : longest) {
    size = rounded(size + length_bytes, kCacheLine);
  }
  return longest;
}

}  // namespace

static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

std::size_t SlotPlaces::place(const Sizes& strides) {
  std::size_t at = kHeadBytes;
  for (std::size_t series = 0; series < kSharedSeries; ++series) {
    stride_.at(series) = strides.at(series);
    first_.at(series) = at;
    at += rounded(kSlots * strides.at(series), kPage);
  }
  return at;
}

SlotWriter::SlotWriter(const Sizes& longest)
    : SlotPlaces(nullptr, nullptr),
      records_memory_(place(strides(longest, kLengthBytes)), SharedMemory::Other::reads),
      reports_memory_(kReportBytes, SharedMemory::Other::writes) {
  static_assert(sizeof(Head) <= kHeadBytes && sizeof(Reports) <= kReportBytes);
  records_ = records_memory_.data();
  reports_ = reports_memory_.data();
  new (records_) Head();
  new (reports_) Reports();
  for (std::size_t series = 0; series < kSharedSeries; ++series) {
    head().series.at(series).stride = stride_.at(series);
  }
}

// A process that takes over trusts `kept` alone, which is hence stored whenever it changes.
[[gnu::hot]] std::uint64_t SlotWriter::carried_out(std::size_t series) {
  std::uint64_t& known = done_.at(series);
  const std::uint64_t done = report(series).done.load(std::memory_order_acquire);
  if (done == known) {
    return known;
  }
  if (done - known > last_.at(series) - known) {
    damaged_.raise();
  } else {
    known = done;
    head().series.at(series).kept.store(done, std::memory_order_relaxed);
  }
  return known;
}

void SlotWriter::forget_damage() {
  for (std::size_t series = 0; series < kSharedSeries; ++series) {
    const std::uint64_t kept = head().series.at(series).kept.load(std::memory_order_acquire);
    const std::uint64_t done = report(series).done.load(std::memory_order_relaxed);
    const std::uint64_t last = head().series.at(series).last.load(std::memory_order_acquire);
    if (done - kept > last - kept) {
      report(series).done.store(kept, std::memory_order_release);
    }
  }
  damaged_.lower();
}

[[gnu::hot]] std::span<std::byte> SlotWriter::draft(std::size_t series) {
  const std::uint64_t number = last_.at(series) + 1;
  if (number - carried_out(series) >= kSlots) {
    return {};
  }
  return {slot(series, number) + kLengthBytes, stride_.at(series) - kLengthBytes};
}

[[gnu::hot]] std::uint64_t SlotWriter::publish(std::size_t series, std::size_t length) {
  LINEGATE_ASSERT(length <= stride_.at(series) - kLengthBytes, "the record has room");
  const std::uint64_t number = ++last_.at(series);
  const std::uint64_t stored = length;
  std::memcpy(slot(series, number), &stored, sizeof stored);
  head().series.at(series).last.store(number, std::memory_order_release);
  published_.add();
  return number;
}

SlotReader::SlotReader(const std::array<int, 2>& descriptors)
    : SlotPlaces(nullptr, nullptr),
      records_memory_(descriptors[0], SharedMemory::kAnySize, SharedMemory::Other::reads),
      reports_memory_(descriptors[1], kReportBytes, SharedMemory::Other::writes) {
  records_ = records_memory_.data();
  reports_ = reports_memory_.data();
  Sizes strides{};
  bool good = records_memory_.size() >= kHeadBytes;
  for (std::size_t series = 0; series < kSharedSeries && good; ++series) {
    strides.at(series) = head().series.at(series).stride;
    good = strides.at(series) > kLengthBytes && strides.at(series) < records_memory_.size();
  }
  if (!good || place(strides) != records_memory_.size()) {
    throw std::system_error(EINVAL, std::generic_category(), "shared slots");
  }
  for (std::size_t series = 0; series < kSharedSeries; ++series) {
    const std::uint64_t kept = head().series.at(series).kept.load(std::memory_order_relaxed);
    const std::uint64_t last = head().series.at(series).last.load(std::memory_order_acquire);
    const std::uint64_t done = report(series).done.load(std::memory_order_relaxed);
    const std::uint64_t valid = done - kept <= last - kept ? done : kept;
    report(series).done.store(valid, std::memory_order_release);
    next_.at(series) = std::max<std::uint64_t>(valid, 1);
  }
}

bool SlotReader::any() const {
  for (std::size_t series = 0; series < kSharedSeries; ++series) {
    if (head().series.at(series).last.load(std::memory_order_acquire) >= next_.at(series)) {
      return true;
    }
  }
  return false;
}

SlotReader::Record SlotReader::next(std::size_t series) const {
  const std::uint64_t number = next_.at(series);
  if (head().series.at(series).last.load(std::memory_order_acquire) < number) {
    return {};
  }
  const std::byte* const at = slot(series, number);
  std::uint64_t length = 0;
  std::memcpy(&length, at, sizeof length);
  return {number, {at + kLengthBytes, std::min(length, stride_.at(series) - kLengthBytes)}};
}

void SlotReader::done(std::size_t series) {
  report(series).done.store(next_.at(series)++, std::memory_order_release);
}

}  // namespace linegate::exchange
