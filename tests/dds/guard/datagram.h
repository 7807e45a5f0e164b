// SPDX-License-Identifier: Apache-2.0
// Builds RTPS datagrams octet by octet, in either octet order.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "bridges/dds/guard/submessages.h"

namespace linegate::test {

// A sequence of fields in one octet order.
class Fields {
 public:
  explicit Fields(bool little = true) : little_(little) {}

  Fields& u8(unsigned value) {
    octets_.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  Fields& u16(unsigned value) {
    return little_ ? u8(value & 0xFF).u8(value >> 8U) : u8(value >> 8U).u8(value & 0xFF);
  }
  Fields& u32(std::uint32_t value) {
    return little_ ? u16(value & 0xFFFF).u16(value >> 16U) : u16(value >> 16U).u16(value & 0xFFFF);
  }
  Fields& number(std::int64_t value) {
    const auto bits = static_cast<std::uint64_t>(value);
    return u32(static_cast<std::uint32_t>(bits >> 32U)).u32(static_cast<std::uint32_t>(bits));
  }
  Fields& entity(std::uint32_t id) {
    return u8(id >> 24U).u8(id >> 16U & 0xFF).u8(id >> 8U & 0xFF).u8(id & 0xFF);
  }
  Fields& octets(const std::vector<std::uint8_t>& more) {
    octets_.insert(octets_.end(), more.begin(), more.end());
    return *this;
  }
  Fields& zeros(std::size_t count) {
    octets_.resize(octets_.size() + count);
    return *this;
  }
  // A CDR string with its terminating NUL, padded to a multiple of 4.
  Fields& string(std::string_view text) {
    u32(static_cast<std::uint32_t>(text.size() + 1));
    octets_.insert(octets_.end(), text.begin(), text.end());
    return zeros(1).pad();
  }
  Fields& pad() {
    octets_.resize(dds::guard::align4(octets_.size()));
    return *this;
  }
  Fields& parameter(unsigned id, const Fields& value) {
    return u16(id).u16(static_cast<unsigned>(value.octets_.size())).octets(value.octets_);
  }
  Fields& sentinel() { return u16(1).u16(0); }

  bool little() const { return little_; }
  const std::vector<std::uint8_t>& get() const { return octets_; }

 private:
  bool little_;
  std::vector<std::uint8_t> octets_;
};

using Sender = std::uint8_t;  // the octet that fills a participant prefix

inline dds::guard::Prefix prefix_of(Sender sender) {
  dds::guard::Prefix out{};
  out.fill(sender);
  out[0] = 0x01;
  out[1] = 0x0F;
  return out;
}

// A datagram of Fast DDS (vendor 01.0Fh).
class Datagram {
 public:
  explicit Datagram(const dds::guard::Prefix& from) {
    const auto header = {'R', 'T', 'P', 'S', '\x02', '\x03', '\x01', '\x0F'};
    for (const char octet : header)
      octets_.push_back(static_cast<std::uint8_t>(octet));
    octets_.insert(octets_.end(), from.begin(), from.end());
  }
  explicit Datagram(Sender sender = 1) : Datagram(prefix_of(sender)) {}

  // length: octetsToNextHeader; -1: the length of the body.
  Datagram& add(unsigned kind, const Fields& body, unsigned flags = 0, int length = -1) {
    Fields header(body.little());
    header.u8(kind).u8(flags | (body.little() ? 1U : 0U));
    header.u16(length < 0 ? static_cast<unsigned>(body.get().size())
                          : static_cast<unsigned>(length));
    octets_.insert(octets_.end(), header.get().begin(), header.get().end());
    octets_.insert(octets_.end(), body.get().begin(), body.get().end());
    return *this;
  }
  std::vector<std::uint8_t>& get() { return octets_; }

 private:
  std::vector<std::uint8_t> octets_;
};

inline constexpr std::uint32_t kReader = 0x00000104;  // entity IDs of an application
inline constexpr std::uint32_t kWriter = 0x00000203;

inline Fields heartbeat(std::int64_t first, std::int64_t last, bool little = true,
                        std::uint32_t writer = kWriter, std::uint32_t reader = 0) {
  return Fields(little).entity(reader).entity(writer).number(first).number(last).u32(1);
}

inline Fields gap(std::int64_t start, std::int64_t base, std::uint32_t bits = 0, bool little = true,
                  std::uint32_t writer = kWriter, std::uint32_t reader = 0) {
  return Fields(little).entity(reader).entity(writer).number(start).number(base).u32(bits).zeros(
      (bits + 31) / 32 * 4);
}

inline Fields acknack(std::int64_t base, std::uint32_t bits, std::uint32_t reader = kReader,
                      std::uint32_t writer = kWriter, bool little = true) {
  return Fields(little)
      .entity(reader)
      .entity(writer)
      .number(base)
      .u32(bits)
      .zeros((bits + 31) / 32 * 4)
      .u32(1);
}

// The body of DATA up to its inline QoS.
inline Fields data(std::int64_t number, std::uint32_t writer = kWriter, bool little = true,
                   std::uint32_t reader = 0) {
  return Fields(little).u16(0).u16(16).entity(reader).entity(writer).number(number);
}

// The body of DATA_FRAG with one fragment of `size` octets.
inline Fields fragment_of(std::uint32_t writer, std::int64_t number, std::uint32_t sample,
                          std::uint32_t fragment = 1, unsigned size = 64) {
  return Fields()
      .u16(0)
      .u16(28)
      .entity(0)
      .entity(writer)
      .number(number)
      .u32(fragment)
      .u16(1)
      .u16(size)
      .u32(sample)
      .zeros(size);
}

inline constexpr unsigned kHasInlineQos = 0x02;  // flags of DATA
inline constexpr unsigned kHasData = 0x04;
inline constexpr unsigned kHasKey = 0x08;

}  // namespace linegate::test
