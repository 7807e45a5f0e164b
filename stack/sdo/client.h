// One SDO client channel (CiA 301, 7.2.4; objects 1280h and following): one transfer at a time with
// one server, expedited up to four bytes, in segments beyond.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/description.h"
#include "stack/sdo/outbox.h"
#include "stack/sdo/transfer.h"

namespace linegate::sdo {

// How a transfer ended.
struct Outcome {
  AbortCode abort = AbortCode::none;  // none: it went well. The server's code, or the one this
                                      // client aborted with
  std::vector<std::byte> data{};      // what an upload brought; empty after a download or abort
};

// What a frame with the response identifier was.
enum class Receipt : std::uint8_t {
  used,       // belongs to the transfer under way (and may have ended it)
  stray,      // expected, but not an answer to what is under way: late, a repetition, or for
              // somebody else
  unasked,    // nothing is under way and nothing late is due: an answer to somebody else
  malformed,  // not a frame of 8 bytes; not processed
};

class Client {
 public:
  // Uploads with more bytes are aborted with 0504 0005h.
  static constexpr std::size_t kMaxUpload = std::size_t{16} * 1024 * 1024;

  // request: client to server. Whoever owns the dispatch table brings the responses.
  explicit Client(can::CobId request);

  // Begin a transfer. timeout is for each answer of the server and must be positive. A frame that
  // does not fit into the queue is sent by advance(). Precondition: !busy() and no outcome to take.
  void read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue);
  void write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
             can::TransmitQueue& queue);

  // A frame with the response identifier; frame.time is now.
  //
  // Ends the transfer, with an abort to the server, for a wrong toggle bit (0503 0000h), an answer
  // to another service (0504 0001h), to another multiplexer (0604 0043h), more or fewer bytes than
  // indicated (0607 0012h, 0607 0013h); answers to something else that are expected are strays, see
  // expect_stray().
  Receipt receive(const can::Frame& frame, can::TransmitQueue& queue);

  // Ends a transfer whose server did not answer in time, with abort 0504 0000h to the server, and
  // sends what did not fit into the queue.
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // Ends the transfer with an abort to the server. No effect if there is none.
  void abort(AbortCode code, Instant now, can::TransmitQueue& queue);

  // One answer more that belongs to somebody or something else may come: the next one that does not
  // fit is then a stray instead of an error. So it is by itself after a time-out or abort(), when
  // the old answer may still come, even after an answer that fitted (which may have been the old
  // one to the same question); whoever hears somebody else use the same server tells it here.
  void expect_stray() { strays_expected_ += strays_expected_ < kMaxStrays ? 1U : 0U; }
  bool strays_expected() const { return strays_expected_ > 0; }

  bool busy() const { return state_ != State::idle; }
  // Once when a transfer has ended.
  std::optional<Outcome> take();

 private:
  static constexpr unsigned kMaxStrays = 4;

  enum class State : std::uint8_t {
    idle,
    upload_initiate,  // each: waiting for the answer to that service
    upload_segment,
    download_initiate,
    download_segment,
  };

  void begin(od::Address address, Duration timeout);
  void request(State state, std::uint64_t word, Instant now, can::TransmitQueue& queue);
  void request_upload_segment(Instant now, can::TransmitQueue& queue);
  void send_download_segment(Instant now, can::TransmitQueue& queue);

  Receipt initiate_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode upload_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode segment_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode upload_segment_came(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode download_segment_taken(Instant now, can::TransmitQueue& queue);
  Receipt aborted_by_server(std::uint64_t word);
  bool take_stray();
  bool waits_for_initiate() const;
  void finish(AbortCode code);

  State state_ = State::idle;
  bool toggle_ = false;  // of the segment under way
  unsigned strays_expected_ = 0;
  od::Address address_;
  Duration timeout_{};
  Instant deadline_ = kNever;
  std::uint64_t last_used_ = 0;  // the answer taken last, to know its repetition
  Source source_;
  Sink sink_;
  Outbox outbox_;
  std::optional<Outcome> outcome_;
};

}  // namespace linegate::sdo
