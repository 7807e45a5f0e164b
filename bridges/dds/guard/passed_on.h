// SPDX-License-Identifier: Apache-2.0
// What of a datagram is passed on, submessage by submessage.
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

// A copy: what was received may lie in memory that is shared with other processes. Made once for a
// thread; allocates again only for a datagram that is longer than `size` and all before.
class PassedOn {
 public:
  explicit PassedOn(std::size_t size = 65'536) : octets_(room(size)) {}

  // datagram: kHeader octets or more.
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

  // A GAP that was checked, as one GAP for each of its ranges: of the numbers in a bitmap Fast DDS
  // 2.9.1 does not remove incomplete samples (StatefulReader::processGapMsg looks for another
  // number), notifies them, and aborts (DataReaderHistory.cpp:822). Its reader asks again for
  // ranges beyond kMostGaps in a datagram.
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

  // The sample that is added next has that timestamp, and no other one has. An INFO_TS that no
  // sample has used is changed, otherwise another one is put in (RTPS 2.3 9.4.5.11).
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
  static constexpr std::size_t kGap = 32;        // octets of one without a bitmap
  static constexpr std::size_t kMostGaps = 512;  // of a datagram
  static constexpr std::size_t kInfoTs = 12;     // octets
  static constexpr std::size_t kLeastData = 24;  // octets of a DATA
  static constexpr std::uint8_t kLittle = 0x01;

  // Each DATA may need an INFO_TS more.
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
    append(it.body.octets().first(8));  // reader and writer
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

  // Seconds and fraction of a timestamp, or a sequence number: the high half comes first.
  void write_number(std::size_t at, std::int64_t value, bool little) {
    const auto bits = static_cast<std::uint64_t>(value);
    write(at, static_cast<std::uint32_t>(bits >> 32U), little);
    write(at + 4, static_cast<std::uint32_t>(bits), little);
  }

  std::vector<std::uint8_t> octets_;
  std::size_t size_ = 0;
  std::size_t last_ = 0;
  std::size_t gaps_ = 0;
  std::size_t info_ts_ = 0;  // one that no sample has used; 0: none
};

}  // namespace linegate::dds::guard
