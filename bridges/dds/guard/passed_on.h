// What of a datagram is passed on, submessage by submessage.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
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
    append(datagram.first(kHeader));
  }

  // A submessage of that datagram, with its header.
  void add(const Submessage& it, Octets octets) {
    if (it.kind == Kind::info_ts && (it.flags & kInvalidate) == 0)
      info_ts_ = size_;
    else if (it.kind != Kind::info_dst)
      info_ts_ = 0;
    append(octets);
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
    const auto bits = static_cast<std::uint64_t>(time);
    write(info_ts_ + 4, static_cast<std::uint32_t>(bits >> 32U), little);
    write(info_ts_ + 8, static_cast<std::uint32_t>(bits), little);
  }

  Octets octets() const { return Octets(octets_).first(size_); }

 private:
  static constexpr std::size_t kInfoTs = 12;     // octets
  static constexpr std::size_t kLeastData = 24;  // octets of a DATA
  static constexpr std::uint8_t kLittle = 0x01;

  // Each DATA may need an INFO_TS more.
  static constexpr std::size_t room(std::size_t size) {
    return size + size / kLeastData * kInfoTs + kInfoTs;
  }

  void append(Octets octets) {
    std::copy(octets.begin(), octets.end(), octets_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += octets.size();
  }

  void write(std::size_t at, std::uint32_t value, bool little) {
    for (unsigned i = 0; i < 4; ++i)
      octets_[at + i] = static_cast<std::uint8_t>(value >> (little ? 8 * i : 24 - 8 * i));
  }

  std::vector<std::uint8_t> octets_;
  std::size_t size_ = 0;
  std::size_t info_ts_ = 0;  // one that no sample has used; 0: none
};

}  // namespace linegate::dds::guard
