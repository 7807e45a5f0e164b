// SPDX-License-Identifier: Apache-2.0
// One SDO client channel (CiA 301, 7.2.4; objects 1280h and following): one transfer at a time with
// one server, expedited up to four bytes, in segments beyond, in blocks where that is worth it and
// the server can.
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
#include "stack/sdo/block.h"
#include "stack/sdo/outbox.h"
#include "stack/sdo/requests_under_way.h"
#include "stack/sdo/transfer.h"

namespace linegate::sdo {

// Which protocol carries a transfer. A block transfer that the server refuses or does not answer at
// its initiate goes on in segments, unless the abort code is about the object.
enum class Transfer : std::uint8_t {
  automatic,  // expedited up to 4 bytes, in blocks from TransferOptions::block_from on, else in
              // segments. A read begins in segments; when the server indicates such a size it is
              // aborted (0800 0000h) and begun in blocks
  segmented,  // expedited up to 4 bytes, else in segments
  block,      // in blocks; a read lets the server take segments for a few bytes
};

// TransferOptions::block_from: no block transfer at all.
inline constexpr std::uint32_t kNoBlocks = 0xFFFF'FFFF;

struct TransferOptions {
  Transfer transfer = Transfer::automatic;
  unsigned repeats = 0;  // how often a transfer is begun anew that ended because a frame was lost:
                         // abort 0503 0000h, 0504 0000h, 0504 0003h or 0504 0004h of either side. A
                         // write whose last segment was sent is not: it may have taken effect
  std::uint32_t block_from = 128;  // bytes, see Transfer::automatic; kNoBlocks: never
};

// How a transfer ended.
struct Outcome {
  AbortCode abort = AbortCode::none;  // none: it went well. The server's code, or the one this
                                      // client aborted with
  std::vector<std::byte> data{};  // what an upload brought; empty after a download or abort, and
                                  // of an upload into a stream
  bool refused = false;  // abort is what the server said to this transfer. Else a frame was lost,
                         // or what came is no answer to it
};

// What a frame with the response identifier was.
enum class Receipt : std::uint8_t {
  used,       // belongs to the transfer under way (and may have ended it)
  stray,      // expected, but not an answer to what is under way: late, a repetition, or for
              // somebody else
  unasked,    // nothing was asked and nothing late is due: an answer to somebody else
  malformed,  // not a frame of 8 bytes; not processed
};

class Client {
 public:
  // Uploads with more bytes are aborted with 0504 0005h, but for those into a stream.
  static constexpr std::size_t kMaxUpload = std::size_t{16} * 1024 * 1024;
  static constexpr std::uint8_t kSwitchThreshold = 21;  // pst of a read in blocks, bytes

  // request: client to server. Whoever owns the dispatch table brings the responses.
  explicit Client(can::CobId request);

  // The requests go to the default server of that node, and under_way, which must live as long,
  // says which of them were acknowledged on the bus. A request that timed out while it was on its
  // way there may still be answered: the first request of the next transfer waits until nothing of
  // the one before is under way, and then for that answer, or as long as its time-out was.
  void follow(const RequestsUnderWay& under_way, std::uint8_t node);

  // Begin a transfer. timeout is for each answer of the server and must be positive. A frame that
  // does not fit into the queue is sent by advance(), as are the segments of a block. Precondition:
  // !busy() and no outcome to take.
  void read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue,
            TransferOptions options = {});
  void write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
             can::TransmitQueue& queue, TransferOptions options = {});

  // The same with the bytes in a stream, which is asked for them, or gets them, piece by piece; it
  // must live until the transfer has ended, which it is told in any case. Transfer::automatic means
  // blocks, but for a stream that says it has few bytes. A transfer is repeated only if the stream
  // can begin again.
  void read(od::Address address, od::ByteSink& sink, Duration timeout, Instant now,
            can::TransmitQueue& queue, TransferOptions options = {});
  void write(od::Address address, od::ByteSource& source, Duration timeout, Instant now,
             can::TransmitQueue& queue, TransferOptions options = {});

  // A frame with the response identifier; frame.time is now.
  //
  // Ends the transfer, with an abort to the server, for a wrong toggle bit (0503 0000h), an answer
  // to another service (0504 0001h), to another multiplexer (0604 0043h), more or fewer bytes than
  // indicated (0607 0012h, 0607 0013h), a block size of 0 or more than 127 (0504 0002h), a segment
  // or an ackseq there is not (0504 0003h), a wrong check sum (0504 0004h); answers to something
  // else that are expected are strays, see expect_stray(). What a lost frame explains ends with one
  // of those codes that TransferOptions::repeats repeats.
  Receipt receive(const can::Frame& frame, can::TransmitQueue& queue);

  // Ends a transfer whose server did not answer in time, with abort 0504 0000h to the server, or
  // goes on in segments if that was the initiate of a block transfer; and sends what did not fit
  // into the queue.
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // Ends the transfer with an abort to the server, and does not repeat it. No effect if there is
  // none.
  void abort(AbortCode code, Instant now, can::TransmitQueue& queue);

  // Another identifier for the requests. A transfer under way ends with sdo_connection, without a
  // word to the server.
  void configure(can::CobId request);

  // One answer more that belongs to somebody or something else may come: the next one that does not
  // fit is then a stray instead of an error. So it is by itself after a time-out or abort(), when
  // the old answer may still come, even after an answer that fitted (which may have been the old
  // one to the same question); this is for whoever hears somebody else use the same server. What
  // comes before the initiate of a transfer was handed out of the queue is never its answer.
  void expect_stray() { strays_expected_ += strays_expected_ < kMaxStrays ? 1U : 0U; }
  bool strays_expected() const { return strays_expected_ > 0; }

  bool busy() const { return state_ != State::idle; }
  // Once when a transfer has ended.
  std::optional<Outcome> take();

  // The answer to the first frame of a transfer has not come.
  bool waits_for_initiate() const;

 private:
  static constexpr unsigned kMaxStrays = 4;
  // After a block download initiate an acknowledgement is a mistake of the server until then.
  static constexpr Duration kAskedAgainFrom = std::chrono::milliseconds(100);
  // How often frames of a transfer that timed out are looked for.
  static constexpr Duration kLookAgain = std::chrono::milliseconds(10);

  enum class State : std::uint8_t {
    idle,
    upload_initiate,  // each: waiting for the answer to that service
    upload_segment,
    download_initiate,
    download_segment,
    block_download_initiate,
    block_download,  // sending a sub-block, or waiting for its acknowledgement
    block_download_end,
    block_upload_initiate,
    block_upload,      // waiting for segments
    block_upload_end,  // waiting for the end request
  };

  void begin(od::Address address, bool write, od::ByteSink* into, Duration timeout,
             TransferOptions options);
  void start(Instant now, can::TransmitQueue& queue);
  void initiate(Instant now, can::TransmitQueue& queue);
  void request(State state, std::uint64_t word, Instant now, can::TransmitQueue& queue);
  void request_upload_segment(Instant now, can::TransmitQueue& queue);
  AbortCode send_download_segment(Instant now, can::TransmitQueue& queue);

  Receipt initiate_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode upload_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode download_initiated(Instant now, can::TransmitQueue& queue);
  AbortCode start_sink(std::optional<std::uint32_t> announced);
  AbortCode finish_upload();
  bool restart_streams();
  AbortCode answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode segment_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode upload_segment_came(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode download_segment_taken(Instant now, can::TransmitQueue& queue);
  bool is_abort(std::uint8_t command) const;
  Receipt aborted_by_server(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  bool take_stray(std::uint64_t word, Instant now);
  void send_abort(AbortCode code, Instant now, can::TransmitQueue& queue);
  void give_up(AbortCode why, Instant now, can::TransmitQueue& queue);
  bool may_have_taken_effect() const;
  void finish_or_repeat(AbortCode code, Instant now, can::TransmitQueue& queue);
  void finish(AbortCode code);

  // --- client_unanswered.cpp
  // ----------------------------------------------------------------------
  // What a transfer that timed out has left behind.
  enum class Unanswered : std::uint8_t {
    nothing,
    under_way,  // frames to the bus
    due,        // the answer to them
  };
  static Instant next_look(Instant now);
  bool is_under_way(const can::TransmitQueue& queue) const;
  void note_unanswered(Instant now, const can::TransmitQueue& queue);
  void note_answer(Instant now, can::TransmitQueue& queue);
  void follow_unanswered(Instant now, can::TransmitQueue& queue);
  void hold(std::uint64_t word, Instant now);

  // --- client_block.cpp
  // ---------------------------------------------------------------------------
  bool in_block() const { return state_ >= State::block_download_initiate; }
  bool worth_a_block(std::optional<std::uint32_t> size) const;
  void initiate_block(Instant now, can::TransmitQueue& queue);
  bool initiate_answer_lost(std::uint8_t command, Instant now) const;
  bool fits_block_initiate(std::uint8_t command) const;
  bool initiates_block() const;
  bool fall_back_unanswered(Instant now, can::TransmitQueue& queue);
  AbortCode block_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  bool fall_back(AbortCode code, Instant now, can::TransmitQueue& queue);
  bool is_repetition(std::uint64_t word) const;
  AbortCode block_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode block_acknowledged(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode block_segment_came(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode block_upload_ended(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  void acknowledge_block(Instant now, can::TransmitQueue& queue);
  AbortCode send_segments(Instant now, can::TransmitQueue& queue);
  void advance_block(Instant now, can::TransmitQueue& queue);
  Duration stall() const { return timeout_ * 2 / 5; }
  // A server may pause within a sub-block: what is missing is not taken for lost before stall(),
  // and sub-blocks stay long even where segments are lost.
  static constexpr std::uint8_t kFewestSegments = 64;

  State state_ = State::idle;
  bool toggle_ = false;  // of the segment under way
  unsigned strays_expected_ = 0;
  od::Address address_;
  bool writing_ = false;
  od::ByteSink* into_ = nullptr;  // of an upload into a stream
  Duration timeout_{};
  TransferOptions options_;
  Instant deadline_ = kNever;
  std::uint64_t last_used_ = 0;  // the answer taken last, to know its repetition
  Source source_;
  Sink sink_;
  Outbox outbox_;
  std::optional<Outcome> outcome_;

  const RequestsUnderWay* under_way_ = nullptr;
  std::uint8_t node_ = 0;
  Unanswered unanswered_ = Unanswered::nothing;
  bool answer_came_ = false;  // Unanswered::under_way: it was received before the acknowledgement
  Duration answer_time_{};    // Unanswered::due lasts so long
  Instant look_again_ = kNever;        // the end of what unanswered_ says, or when to look for it
  std::optional<std::uint64_t> held_;  // a first request that waits for that

  bool tried_block_ = false;                // in this transfer
  bool blocks_refused_ = false;             // by the server, as far as known
  bool block_unanswered_ = false;           // the block initiate before was not answered
  std::optional<std::uint32_t> told_size_;  // of a read that changes to blocks
  Instant block_wake_ = kNever;  // block_download: more segments; block_upload: it stalls
  BlockSender sender_;
  BlockReceiver receiver_;
  LateSegments late_;
};

}  // namespace linegate::sdo
