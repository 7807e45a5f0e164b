// The bytes of one transfer on their way: what is independent of how frames carry them, in segments
// or in blocks, which rewind the Source to repeat what was lost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"

namespace linegate::sdo {

// The sending side: a value as it was when the transfer began, given out in pieces.
class Source {
 public:
  // Copies value; room once allocated is kept for later transfers.
  void start(std::span<const std::byte> value);
  void start(std::vector<std::byte>&& value);

  std::size_t size() const { return bytes_.size(); }
  std::size_t remaining() const { return bytes_.size() - position_; }

  // Fills out with the next bytes and the rest of it with zeros. Gives how many are bytes.
  std::size_t next(std::span<std::byte> out);
  // The next bytes are those from position on. Precondition: position <= size().
  void rewind(std::size_t position) { position_ = position; }

 private:
  std::vector<std::byte> bytes_;
  std::size_t position_ = 0;
};

// The receiving side: collects the pieces and holds them against what was announced.
class Sink {
 public:
  // announced: the size indicated at the initiate, if any. limit: most bytes that will be taken.
  // over_limit: what more of them mean.
  void start(std::optional<std::uint32_t> announced, std::size_t limit, AbortCode over_limit);

  // length_too_high if there is more than announced, over_limit if more than limit; the piece is
  // not taken then.
  AbortCode append(std::span<const std::byte> piece);
  // length_too_low if there is less than announced.
  AbortCode finish() const;

  std::span<const std::byte> bytes() const { return bytes_; }
  std::vector<std::byte> take();

 private:
  std::vector<std::byte> bytes_;
  std::optional<std::uint32_t> announced_;
  std::size_t limit_ = 0;
  AbortCode over_limit_ = AbortCode::none;
};

}  // namespace linegate::sdo
