// SPDX-License-Identifier: Apache-2.0
// The part of a datagram that is passed on, submessage by submessage.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bridges/dds/guard/sample_times.h"
#include "bridges/dds/guard/submessages.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// A copy, because a received datagram may be in memory that is shared with other processes. Each
// thread has one; it allocates again only for a datagram that is longer than `size` and all
// previous ones.
class PassedOn {
 public:
  explicit PassedOn(std::size_t size = 65'536) : octets_(room(size)) {}

  // datagram: at least kHeader octets.
  void begin(Octets datagram) {
    if (octets_.size() < room(datagram.size()))
      octets_.resize(room(datagram.size()));
    size_ = 0;
    info_ts_ = 0;
    gaps_ = 0;
    append(datagram.first(kHeader));
  }

  // A submessage of that datagram, with its header.
  void add(const Submessage& it, Octets octets) {
    if (it.kind == Kind::info_ts && (it.flags & kInvalidate) == 0)
      info_ts_ = size_;
    else if (it.kind != Kind::info_dst)
      info_ts_ = 0;
    last_ = size_;
    append(octets);
  }

  // The submessage that was added last.
  std::span<std::uint8_t> last() { return std::span(octets_).subspan(last_, size_ - last_); }

  // Adds a checked GAP as one GAP for each of its ranges. For the numbers in a bitmap, Fast
  // DDS 2.9.1 does not remove incomplete samples (StatefulReader::processGapMsg looks for another
  // number), notifies them, and aborts (DataReaderHistory.cpp:822). Ranges beyond kMostGaps in a
  // datagram are dropped; the reader requests them again.
  void add_gap(const Submessage& it) {
    info_ts_ = 0;
    Number begin = it.body.number(8);
    const Number base = it.body.number(16);
    Number end = base;
    for (std::uint32_t i = 0; i < it.body.u32(24); ++i) {
      if ((it.body.u32(28 + i / 32 * 4) >> (31 - i % 32) & 1U) == 0)
        continue;
      if (base + i != end) {
        append_gap(it, begin, end);
        begin = base + i;
      }
      end = base + i + 1;
    }
    append_gap(it, begin, end);
  }

  // Sets the timestamp of the next sample, and of that one only. Changes an INFO_TS that no sample
  // has used yet, or else inserts one (RTPS 2.3 9.4.5.11).
  void stamp(SampleTime time) {
    if (info_ts_ == 0) {
      info_ts_ = size_;
      append(std::array<std::uint8_t, kInfoTs>{static_cast<std::uint8_t>(Kind::info_ts), kLittle,
                                               kInfoTs - 4, 0});
    }
    const bool little = (octets_[info_ts_ + 1] & kLittle) != 0;
    write_number(info_ts_ + 4, time, little);
  }

  Octets octets() const { return Octets(octets_).first(size_); }

 private:
  static constexpr std::size_t kGap = 32;        // octets of a GAP without a bitmap
  static constexpr std::size_t kMostGaps = 512;  // in one datagram
  static constexpr std::size_t kInfoTs = 12;     // octets
  static constexpr std::size_t kLeastData = 24;  // octets of the shortest DATA
  static constexpr std::uint8_t kLittle = 0x01;

  // Each DATA may need an additional INFO_TS.
  static constexpr std::size_t room(std::size_t size) {
    return size + size / kLeastData * kInfoTs + kInfoTs + kMostGaps * kGap;
  }

  void append_gap(const Submessage& it, Number begin, Number end) {
    if (begin >= end || gaps_ == kMostGaps)
      return;
    ++gaps_;
    const std::size_t at = size_;
    const std::uint8_t little = it.flags & kLittle;
    constexpr std::uint8_t kLength = kGap - 4;
    append(std::array<std::uint8_t, 4>{static_cast<std::uint8_t>(Kind::gap), little,
                                       little != 0 ? kLength : std::uint8_t{0},
                                       little != 0 ? std::uint8_t{0} : kLength});
    append(it.body.octets().first(8));  // reader and writer ID
    size_ = at + kGap;
    write_number(at + 12, begin, little != 0);
    write_number(at + 20, end, little != 0);
    write(at + 28, 0, true);
  }

  void append(Octets octets) {
    std::copy(octets.begin(), octets.end(), octets_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += octets.size();
  }

  void write(std::size_t at, std::uint32_t value, bool little) {
    for (unsigned i = 0; i < 4; ++i)
      octets_[at + i] = static_cast<std::uint8_t>(value >> (little ? 8 * i : 24 - 8 * i));
  }

  // Writes the seconds and fraction of a timestamp, or a sequence number: the high half first.
  void write_number(std::size_t at, std::int64_t value, bool little) {
    const auto bits = static_cast<std::uint64_t>(value);
    write(at, static_cast<std::uint32_t>(bits >> 32U), little);
    write(at + 4, static_cast<std::uint32_t>(bits), little);
  }

  std::vector<std::uint8_t> octets_;
  std::size_t size_ = 0;
  std::size_t last_ = 0;
  std::size_t gaps_ = 0;
  std::size_t info_ts_ = 0;  // position of an INFO_TS that no sample has used yet; 0: none
};

}  // namespace linegate::dds::guard
