// SPDX-License-Identifier: Apache-2.0
// How far a forwarded SDO transfer is: its frames are copied as they are, so all a gateway has to
// know is where the transfer ends, and which frames are segments of a block, whose first byte may
// look like anything.
#pragma once

#include <cstdint>

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
  // Such a request writes.
  static bool writes(std::uint64_t request);

  // A frame from the client, from the server. What begins a transfer drops the one before.
  End request(std::uint64_t word);
  End response(std::uint64_t word);
  void reset() { *this = {}; }

  // What the client sends now are segments of a block, or an abort.
  bool in_sub_block() const { return state_ == State::block_segments; }
  // A transfer was begun and has not ended.
  bool under_way() const { return state_ != State::idle; }
  // The first answer of the server is due, and `word` can be it.
  bool awaits_first_answer() const;
  bool is_first_answer(std::uint64_t word) const;
  // Of the transfer begun last.
  enum class Service : std::uint8_t { none, upload, download };  // numbers as in EventKind
  od::Address address() const { return address_; }
  Service service() const { return service_; }
  // Of its value: those that were sent, in a block those that were acknowledged.
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
    block_download_end,  // all were acknowledged
    block_upload_initiate,
    block_upload,
  };

  void begin(std::uint64_t word);
  End answered_initiate(std::uint8_t command);
  void acknowledged(unsigned segments);
  void block_ends(std::uint8_t command);
  End end(End how);

  State state_ = State::idle;
  bool last_ = false;               // download: expedited, or the last segment was sent
  std::uint64_t last_segment_ = 0;  // block download: the frame with the flag of the last one
  od::Address address_;
  Service service_ = Service::none;
  std::uint32_t bytes_ = 0;
  std::uint8_t unused_ = 0;  // bytes of the last segment of a block transfer
};

}  // namespace linegate::routing
