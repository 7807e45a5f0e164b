// SPDX-License-Identifier: Apache-2.0
// Assembles SDO transfers between other nodes on one channel (the default channel of a node is 600h
// and 580h + node-ID; CiA 301, 7.2.4.3) from the frames on the bus: expedited, segmented and block
// transfers.
//
// Frames of both sides are needed: a transfer is reported when the server has answered its last
// frame, or when either side has aborted it. A transfer that began before this object was created,
// or of which a frame was missed, is not reported; the next initiate of the client starts a new
// one.
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
  bool download = false;  // the client wrote
  bool aborted = false;
  AbortCode abort = AbortCode::none;  // as sent, which may be 0; only if it was aborted
  std::uint64_t size = 0;             // bytes of the value, if it was successful
  std::array<std::byte, kKept> data{};

  // The value, or its first bytes if it is longer.
  std::span<const std::byte> kept() const {
    return std::span(data).first(size < kKept ? static_cast<std::size_t>(size) : kKept);
  }
  bool complete() const { return !aborted && size <= kKept; }
};

class SdoFollower {
 public:
  // A transfer without a frame for this time was abandoned by both sides.
  static constexpr Duration kPatience = std::chrono::seconds(10);

  // Process a frame of the client or of the server, at frame.time. Return the transfer that ends
  // with it, if any. Frames that are not SDO frames have no effect.
  std::optional<Transfer> request(const can::Frame& frame);
  std::optional<Transfer> answer(const can::Frame& frame);

 private:
  enum class Phase : std::uint8_t {
    idle,
    download,           // initiate sent, waits for its answer
    download_segments,  // between an answer and the next segment
    download_segment,   // a segment was sent
    upload,             // initiate sent
    upload_segments,    // answered with a size: segments follow
    upload_segment,     // a segment was requested
    block_download,     // initiate sent
    block_taking,       // the client sends segments
    block_taken,        // the client has sent the end
    block_upload,       // initiate sent
    block_offered,      // answered: the client may start
    block_giving,       // the server sends segments
    block_given,        // the server has sent the end
  };

  std::optional<Transfer> begin(const can::Frame& frame);
  std::optional<Transfer> answer_block(std::uint8_t command, const can::Frame& frame);
  std::optional<Transfer> end();
  std::optional<Transfer> abort(const can::Frame& frame);
  std::optional<Transfer> receive_upload(std::uint8_t command, const can::Frame& frame);
  std::optional<Transfer> lose();
  void receive_segment(std::uint8_t command, const can::Frame& frame);
  void receive_block_segment(const can::Frame& frame);
  void acknowledge(std::uint8_t number);
  void keep(std::uint64_t at, std::span<const std::byte> bytes);
  bool is_mine(const can::Frame& frame) const;
  void look_at_time(const can::Frame& frame);

  Phase phase_ = Phase::idle;
  Transfer transfer_;
  bool expedited_ = false;
  bool toggle_ = false;  // of the next segment
  bool last_ = false;    // the last segment was on the bus
  bool holes_ = false;   // not every byte was received
  std::uint8_t last_block_segment_ = 0;
  std::bitset<128> heard_;  // segments of this block that were received
  Instant heard_at_{};
};

}  // namespace linegate::observer
