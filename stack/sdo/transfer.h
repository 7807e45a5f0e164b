// SPDX-License-Identifier: Apache-2.0
// The bytes of one transfer on their way: what is independent of how frames carry them, in segments
// or in blocks, which rewind the Source to repeat what was lost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/assert.h"
#include "stack/od/stream.h"

namespace linegate::sdo {

// The sending side: gives a value out in pieces. Either a value as it was when the transfer began,
// or the bytes of an od::ByteSource, of which only a window is kept.
class Source {
 public:
  // Copies value; room once allocated is kept for later transfers.
  void start(std::span<const std::byte> value);
  void start(std::vector<std::byte>&& value);
  // from must live until close().
  void start(od::ByteSource& from);

  // Bytes in all, if known.
  std::optional<std::uint32_t> size() const;

  // Fills out with the next bytes and the rest of it with zeros. Gives how many are bytes.
  // Precondition: out has at most 8 bytes, and no more than kRewind were given since release().
  std::size_t next(std::span<std::byte> out);
  // All bytes were given.
  bool at_end() const { return ended_ && position_ == begin_ + bytes_.size(); }
  // Why next() gave nothing although it is not the end: the source failed, or ended before the size
  // that it told (no_data); od::kLater: it has nothing yet, and next() may be tried again.
  AbortCode error() const { return error_; }

  // The next bytes are those from position on. Precondition: they were given since release().
  void rewind(std::size_t position) {
    LINEGATE_ASSERT(position >= released_ && position <= position_,
                    "the bytes were given since release()");
    position_ = position;
  }
  // rewind() will not go back behind the bytes given so far.
  void release() { released_ = position_; }
  // Begins anew, for another attempt. False if the source cannot.
  bool restart();
  // Nobody reads any more.
  void close(AbortCode why);

 private:
  static constexpr std::size_t kWindow = 2048;
  static constexpr std::size_t kRewind = 1024;

  void begin();
  void fill();

  std::vector<std::byte> bytes_;  // the value, or the window
  od::ByteSource* from_ = nullptr;
  std::size_t begin_ = 0;     // position of bytes_[0]
  std::size_t released_ = 0;  // position
  std::size_t position_ = 0;  // of the next byte
  bool ended_ = true;         // bytes_ has the last byte
  AbortCode error_ = AbortCode::none;
};

// The receiving side: collects the pieces, or hands them to an od::ByteSink, and holds them against
// what was announced.
class Sink {
 public:
  // announced: the size indicated at the initiate, if any. limit: most bytes that will be taken.
  // over_limit: what more of them mean.
  void start(std::optional<std::uint32_t> announced, std::size_t limit, AbortCode over_limit);
  // to must live until finish() or cancel().
  void start(std::optional<std::uint32_t> announced, od::ByteSink& to);

  // length_too_high if there is more than announced, over_limit if more than limit; the piece is
  // not taken then. What the ByteSink says. od::kLater: the piece is taken, but the ByteSink is
  // busy: at most kPiece bytes more before it has answered.
  AbortCode append(std::span<const std::byte> piece);
  // length_too_low if there is less than announced. What the ByteSink says. od::kLater: as long as
  // open(), finish() is to be called again when it has answered, else the answer is the end.
  AbortCode finish();
  // The transfer ended otherwise. No effect after finish() was asked of the ByteSink.
  void cancel(AbortCode why);
  // The bytes are in a ByteSink, not in bytes().
  bool streams() const { return streams_; }
  // The ByteSink did not get its last call.
  bool open() const { return to_ != nullptr; }

  std::span<const std::byte> bytes() const { return bytes_; }
  std::vector<std::byte> take();

 private:
  static constexpr std::size_t kPiece = 2048;

  AbortCode pass_on();

  std::vector<std::byte> bytes_;  // the value, or what the ByteSink did not get yet
  od::ByteSink* to_ = nullptr;
  bool streams_ = false;
  std::size_t received_ = 0;
  std::optional<std::uint32_t> announced_;
  std::size_t limit_ = 0;
  AbortCode over_limit_ = AbortCode::none;
};

}  // namespace linegate::sdo
