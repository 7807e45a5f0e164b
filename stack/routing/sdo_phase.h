// SPDX-License-Identifier: Apache-2.0
// The progress of a forwarded SDO transfer. A gateway copies its frames unchanged, so it must only
// detect the end of the transfer, and the segments of a block, whose first byte may have any value.
#pragma once

#include <cstdint>

#include "stack/base/abort_code.h"
#include "stack/base/events.h"
#include "stack/od/description.h"

namespace linegate::routing {

class SdoPhase {
 public:
  enum class End : std::uint8_t {
    none,
    finished,  // with this frame
    aborted,   // this frame is an abort
  };

  // Whether a request begins a transfer. Precondition: !in_sub_block().
  static bool initiates(std::uint64_t request);
  // Whether such a request begins a download.
  static bool writes(std::uint64_t request);

  // Whether a frame of the client begins a transfer now.
  bool begins(std::uint64_t request) const;

  // Process a frame from the client, from the server. A frame that begins a transfer discards the
  // previous one.
  End request(std::uint64_t word);
  End response(std::uint64_t word);
  void reset() { *this = {}; }

  // The next frames of the client are segments of a block, or an abort.
  bool in_sub_block() const { return state_ == State::block_segments; }
  // A transfer is in progress.
  bool under_way() const { return state_ != State::idle; }
  // The abort code for a transfer that ends because a line stops. A write may have been carried out
  // if the client has sent all of it, with its end in a block transfer.
  AbortCode stop_code() const {
    return under_way() && service_ == Service::download && last_ ? AbortCode::timeout
                                                                 : AbortCode::device_state;
  }
  // Whether the first answer of the server is due, and whether `word` can be that answer.
  bool awaits_first_answer() const;
  bool is_first_answer(std::uint64_t word) const;
  // Object and direction of the last transfer.
  using Service = event::SdoService;
  od::Address address() const { return address_; }
  Service service() const { return service_; }
  // Number of bytes of its value that were sent, or in a block transfer acknowledged.
  std::uint32_t bytes() const { return bytes_; }

 private:
  enum class State : std::uint8_t {
    idle,
    upload_initiate,
    upload,
    download_initiate,
    download,
    block_download_initiate,
    block_segments,      // of a download
    block_download_end,  // all segments were acknowledged
    block_upload_initiate,
    block_upload,
  };

  void begin(std::uint64_t word);
  End answered_initiate(std::uint8_t command);
  void acknowledged(unsigned segments);
  void block_ends(std::uint8_t command);
  End end(End how);

  State state_ = State::idle;
  // Download: expedited, or the last segment was sent; in a block transfer its end
  bool last_ = false;
  std::uint64_t last_segment_ = 0;  // block download: the frame with the flag of the last segment
  od::Address address_;
  Service service_ = Service::none;
  std::uint32_t bytes_ = 0;
  std::uint8_t unused_ = 0;  // unused bytes in the last segment of a block transfer
};

}  // namespace linegate::routing
