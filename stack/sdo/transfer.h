// SPDX-License-Identifier: Apache-2.0
// The bytes of one transfer, independent of segments and blocks; block transfer rewinds the Source
// to repeat lost segments.
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

// The sending side: supplies a value in pieces. Either a copy of the value as of the start, or the
// bytes of an od::ByteSource, of which only a window is kept.
class Source {
 public:
  // Copies value; allocated memory is reused by later transfers.
  void start(std::span<const std::byte> value);
  void start(std::vector<std::byte>&& value);
  // from must live until close().
  void start(od::ByteSource& from);

  // Total size in bytes, if known.
  std::optional<std::uint32_t> size() const;

  // Fills out with the next bytes, and its rest with zeros. Returns the number of bytes.
  // Precondition: out has at most 64 bytes, and at most kRewind bytes were returned since
  // release().
  std::size_t next(std::span<std::byte> out);
  // All bytes were returned.
  bool at_end() const { return ended_ && position_ == begin_ + bytes_.size(); }
  // Why next() returned nothing before the end: the source failed, or ended before its indicated
  // size (no_data). od::kLater: no bytes are available yet; try next() again.
  AbortCode error() const { return error_; }

  // Continues at position. Precondition: the bytes from there on were returned since release().
  void rewind(std::size_t position) {
    LINEGATE_ASSERT(position >= released_ && position <= position_,
                    "the bytes were given since release()");
    position_ = position;
  }
  // rewind() will not go back before the current position.
  void release() { released_ = position_; }
  // The receiver has the bytes before the current position.
  void acknowledge() {
    if (from_ != nullptr) {
      from_->acknowledged(position_);
    }
  }
  // Restarts for another attempt. Returns false if the source cannot.
  bool restart();
  // No more bytes are read.
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

// The receiving side: collects the pieces, or passes them to an od::ByteSink, and checks them
// against the announced size.
class Sink {
 public:
  // announced: the size indicated at the initiate, if any. limit: largest accepted size in bytes.
  // over_limit: abort code for longer values.
  void start(std::optional<std::uint32_t> announced, std::size_t limit, AbortCode over_limit);
  // to must live until finish() or cancel().
  void start(std::optional<std::uint32_t> announced, od::ByteSink& to);

  // Returns length_too_high if there are more bytes than announced, over_limit if more than limit,
  // without taking the piece; else the result of the ByteSink. od::kLater: the piece was taken, but
  // the ByteSink is busy: pass at most kPiece more bytes before it is ready.
  AbortCode append(std::span<const std::byte> piece);
  // Returns length_too_low if there are fewer bytes than announced; else the result of the
  // ByteSink. od::kLater: while open(), call finish() again when the ByteSink is ready, else its
  // deferred result is final.
  AbortCode finish();
  // The transfer failed. No effect after the ByteSink's finish() was called.
  void cancel(AbortCode why);
  // The bytes are passed to a ByteSink, not kept in bytes().
  bool streams() const { return streams_; }
  // The ByteSink did not get its final call (finish or cancel) yet.
  bool open() const { return to_ != nullptr; }

  std::span<const std::byte> bytes() const { return bytes_; }
  std::vector<std::byte> take();

 private:
  static constexpr std::size_t kPiece = 2048;

  AbortCode pass_on();

  std::vector<std::byte> bytes_;  // the value, or bytes not yet passed to the ByteSink
  od::ByteSink* to_ = nullptr;
  bool streams_ = false;
  std::size_t received_ = 0;
  std::optional<std::uint32_t> announced_;
  std::size_t limit_ = 0;
  AbortCode over_limit_ = AbortCode::none;
};

}  // namespace linegate::sdo
