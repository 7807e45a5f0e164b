// SPDX-License-Identifier: Apache-2.0
// SDO transfers of others on one channel (the default one of a node is 600h and 580h + node-ID; CiA
// 301, 7.2.4.3), put together from the frames on the bus: expedited, in segments and in blocks.
//
// Both sides are needed: a transfer is told when the server has answered the last frame of it, or
// either side has aborted it. What begins before one listens, or of which a frame was not heard, is
// not told; the next initiate of the client begins anew.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::observer {

struct Transfer {
  static constexpr std::size_t kKept = 64;

  od::Address address;
  bool download = false;              // the client wrote
  AbortCode abort = AbortCode::none;  // none: it ended well
  std::uint64_t size = 0;             // bytes of the value, if it ended well
  std::array<std::byte, kKept> data{};

  // The value, or its first bytes.
  std::span<const std::byte> kept() const {
    return std::span(data).first(size < kKept ? static_cast<std::size_t>(size) : kKept);
  }
  bool complete() const { return abort == AbortCode::none && size <= kKept; }
};

class SdoFollower {
 public:
  // What stands still for longer was given up by both sides.
  static constexpr Duration kPatience = std::chrono::seconds(10);

  // A frame of the client, of the server, at frame.time. The transfer that ends with it, if one
  // does. Frames that are none of SDO's have no effect.
  std::optional<Transfer> request(const can::Frame& frame);
  std::optional<Transfer> answer(const can::Frame& frame);

 private:
  enum class Phase : std::uint8_t {
    idle,
    download,           // initiate sent, waits for its answer
    download_segments,  // between an answer and the next segment
    download_segment,   // a segment was sent
    upload,             // initiate sent
    upload_segments,    // answered with a size: segments are asked for
    upload_segment,     // one was asked for
    block_download,     // initiate sent
    block_taking,       // the client sends segments
    block_taken,        // the client has told the end
    block_upload,       // initiate sent
    block_offered,      // answered: the client may start
    block_giving,       // the server sends segments
    block_given,        // the server has told the end
  };

  std::optional<Transfer> begin(const can::Frame& frame);
  std::optional<Transfer> answer_block(std::uint8_t command, const can::Frame& frame);
  std::optional<Transfer> end();
  std::optional<Transfer> abort(const can::Frame& frame);
  std::optional<Transfer> take_upload(std::uint8_t command, const can::Frame& frame);
  std::optional<Transfer> lose();
  void take_segment(std::uint8_t command, const can::Frame& frame);
  void take_block_segment(const can::Frame& frame);
  void acknowledge(std::uint8_t number);
  void keep(std::uint64_t at, std::span<const std::byte> bytes);
  bool is_mine(const can::Frame& frame) const;
  void look_at_time(const can::Frame& frame);

  Phase phase_ = Phase::idle;
  Transfer transfer_;
  bool expedited_ = false;
  bool toggle_ = false;  // of the next segment
  bool last_ = false;    // the last segment has been on the bus
  bool holes_ = false;   // not every byte was heard
  std::uint8_t last_block_segment_ = 0;
  std::bitset<128> heard_;  // segments of this block
  Instant heard_at_{};
};

}  // namespace linegate::observer
