// SPDX-License-Identifier: Apache-2.0
// The objects of the SDO target: values, and DOMAINs that are streams. Some hooks and streams
// answer later.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <span>
#include <vector>

#include "stack/od/dictionary.h"
#include "stack/od/stream.h"

#include "tests/fuzz/expect.h"

namespace linegate::fuzz {

// 1000h u32 ro 04030201h; 2000h u8 up to 100; 2001h u64; 2002h string; 2003h DOMAIN; 2004h u32 wo;
// 2005h does not exist; 2006h DOMAIN, a stream; 2007h the same, which sometimes answers later;
// 2008h u32 whose hook always answers later.
od::DeviceDescription sdo_device();

inline constexpr std::uint16_t kStream = 0x2006;
inline constexpr std::uint16_t kSlowStream = 0x2007;
inline constexpr std::uint16_t kSlowValue = 0x2008;

constexpr std::byte pattern_byte(std::uint32_t position) {
  return static_cast<std::byte>((position * 2654435761U) >> 21U);
}

// Selects the calls that are answered later: every third one.
class Delays {
 public:
  bool later() { return ++calls_ % 3 == 0; }

 private:
  unsigned calls_ = 1;
};

// A stream that supplies a pattern of `size` bytes. Expects to be closed once, and no calls after
// that.
class PatternSource final : public od::ByteSource {
 public:
  PatternSource(std::uint32_t size, bool tells, Delays* delays)
      : size_(size), tells_(tells), delays_(delays) {}

  std::optional<std::uint32_t> size() const override {
    return tells_ ? std::optional(size_) : std::nullopt;
  }
  Result<std::size_t> read(std::span<std::byte> out) override;
  bool rewind() override;
  void closed(AbortCode why) override;

  std::uint32_t bytes() const { return size_; }
  bool over() const { return over_; }

 private:
  std::uint32_t size_;
  bool tells_;
  Delays* delays_;  // nullptr: always answers at once
  std::uint32_t position_ = 0;
  bool over_ = false;
};

// A stream that accepts bytes. Expects one finishing call, and no calls after that.
class PatternSink final : public od::ByteSink {
 public:
  explicit PatternSink(Delays* delays) : delays_(delays) {}

  AbortCode write(std::span<const std::byte> piece) override;
  AbortCode finish() override;
  void cancelled(AbortCode why) override;
  bool rewind() override;

  // Whether it was finished with exactly `size` bytes of the pattern.
  bool has(std::uint32_t size) const { return finished_ && right_ && position_ == size; }
  bool over() const { return over_; }

 private:
  Delays* delays_;
  std::uint32_t position_ = 0;
  bool right_ = true;
  bool finished_ = false;
  bool over_ = false;
};

// The hook of 2006h to 2008h.
class SdoObjects final : public od::Hook {
 public:
  explicit SdoObjects(od::Dictionary& dictionary);

  // Sets the server that makes the following calls. A stream belongs to the server that opened it.
  void serve(unsigned server) { server_ = server; }
  const PatternSource* last_source(unsigned server) const { return last_[server].source; }
  const PatternSink* last_sink(unsigned server) const { return last_[server].sink; }

  // Answers one of the waiting calls.
  void answer(std::uint8_t which, bool good);
  // Whether no call waits and no stream is open.
  bool at_rest() const;

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  Result<od::ByteSource*> open_source(od::Address address) override;
  Result<od::ByteSink*> open_sink(od::Address address, std::optional<std::uint32_t> size) override;
  void put_off(od::Address address, od::Ticket ticket) override;
  void cancelled(od::Ticket ticket) override;

 private:
  static constexpr unsigned kServers = 3;
  struct Streams {
    const PatternSource* source = nullptr;
    const PatternSink* sink = nullptr;
  };

  Delays* delays_of(od::Address address) {
    return address.index == kSlowStream ? &delays_ : nullptr;
  }

  od::Dictionary& dictionary_;
  Delays delays_;
  unsigned server_ = 0;
  unsigned opened_ = 0;
  Streams last_[kServers];
  std::list<PatternSource> sources_;
  std::list<PatternSink> sinks_;
  std::vector<od::Ticket> waiting_;
};

}  // namespace linegate::fuzz
