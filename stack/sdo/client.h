// SPDX-License-Identifier: Apache-2.0
// One SDO client channel (CiA 301, 7.2.4; objects 1280h and following): one transfer at a time with
// one server; expedited up to four bytes, segmented above, in blocks if it is faster and the server
// supports it.
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
#include "stack/sdo/transfer_client.h"

namespace linegate::sdo {

class Client final : public TransferClient {
 public:
  static constexpr std::uint8_t kSwitchThreshold = 21;  // pst of a block read, in bytes

  // request: identifier from client to server. The owner of the dispatch table passes the
  // responses.
  explicit Client(can::CobId request);

  // Call it if the requests go to the default server of that node. under_way, which must outlive
  // the client, states which requests were acknowledged on the bus. A request that timed out before
  // it was acknowledged may still be answered: the first request of the next transfer waits until
  // no frame of the previous one is under way, and then for that answer, at most for the previous
  // time-out.
  void follow(const RequestsUnderWay& under_way, std::uint8_t node);

  // Limits the frames of the transfers that begin from now on, as those of that client of the
  // pace, repetitions included; nullptr: no longer. pace must outlive this object.
  void set_pace(Pace* pace, std::uint32_t client) override { outbox_.set_pace(pace, client); }
  // Waits as long for the next answer as if its request were sent now. For a client whose frames
  // are paced elsewhere. No effect if no answer is awaited.
  void restart_timeout(Instant now);
  // Whether another client of the pace waits for the end of the transfer.
  void set_awaited(bool awaited) override { outbox_.set_awaited(awaited); }
  // Counts a frame of the server for the pace.
  void count_received(const can::Header& /*frame*/) const override { outbox_.count_received(); }

  // Starts a transfer. timeout applies to each answer of the server and must be positive. A frame
  // that does not fit into the queue is sent by advance(), as are the segments of a block.
  // Precondition: !busy(), and take() has nothing to return.
  void read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue,
            TransferOptions options = {}) override;
  void write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
             can::TransmitQueue& queue, TransferOptions options = {}) override;

  // The same with a stream, which supplies or receives the bytes in pieces. It must live until the
  // transfer has ended, which is always reported to it. Transfer::automatic selects blocks, except
  // for a stream with a small known size. A transfer is repeated only if the stream can restart.
  void read(od::Address address, od::ByteSink& sink, Duration timeout, Instant now,
            can::TransmitQueue& queue, TransferOptions options = {}) override;
  void write(od::Address address, od::ByteSource& source, Duration timeout, Instant now,
             can::TransmitQueue& queue, TransferOptions options = {}) override;

  // Processes a frame with the response identifier; frame.time is the current time.
  //
  // Ends the transfer, with an abort to the server, for a wrong toggle bit (0503 0000h), an answer
  // to another service (0504 0001h) or another multiplexer (0604 0043h), more or fewer bytes than
  // indicated (0607 0012h, 0607 0013h), a block size of 0 or more than 127 (0504 0002h), an invalid
  // segment number or ackseq (0504 0003h), or a wrong CRC (0504 0004h). Answers to earlier requests
  // that are expected are strays, see expect_stray(). If a lost frame is a possible cause, the code
  // is one of those that TransferOptions::repeats repeats.
  Receipt receive(const can::Frame& frame, can::TransmitQueue& queue) override;

  // Ends a transfer whose server did not answer in time, with abort 0504 0000h to the server, or
  // continues in segments if that was a block initiate; sends frames that did not fit into the
  // queue.
  void advance(Instant now, can::TransmitQueue& queue) override;
  Instant next_wake() const override;

  // Ends the current transfer with an abort to the server, without a repetition. No effect if there
  // is no transfer.
  void abort(AbortCode code, Instant now, can::TransmitQueue& queue) override;

  // Changes the request identifier. A current transfer ends with sdo_connection, without an abort
  // to the server.
  void configure(can::CobId request);

  // Expects one more answer to another client or an earlier request: the next answer that does not
  // match is then a stray instead of an error. The client does so itself after a time-out or
  // abort(), when the old answer may still arrive, even after a matching answer (which may have
  // been the old answer to the same request). Call it when another client of the server is
  // observed. A frame received before the initiate of a transfer was handed out of the queue is
  // never its answer.
  void expect_stray() override { strays_expected_ += strays_expected_ < kMaxStrays ? 1U : 0U; }
  bool strays_expected() const { return strays_expected_ > 0; }

  bool busy() const override { return state_ != State::idle; }
  // Returns the result of a transfer once, after its end.
  std::optional<Outcome> take() override;
  // The current transfer is a write of which all data, in a block transfer also the end request,
  // was passed to the transmit queue in this or an earlier attempt: the server may have carried it
  // out.
  bool may_be_carried_out() const override;

  // The answer to the first frame of a transfer is pending.
  bool waits_for_initiate() const override;

 private:
  static constexpr unsigned kMaxStrays = 4;
  // An acknowledgement this soon after a block download initiate is an error of the server.
  static constexpr Duration kAskedAgainFrom = std::chrono::milliseconds(100);
  // Interval of checks whether frames of a timed-out transfer are still under way.
  static constexpr Duration kLookAgain = std::chrono::milliseconds(10);

  enum class State : std::uint8_t {
    idle,
    upload_initiate,  // each waits for the answer to that service
    upload_segment,
    download_initiate,
    download_segment,
    block_download_initiate,
    block_download,  // sends a sub-block, or waits for its acknowledgement
    block_download_end,
    block_upload_initiate,
    block_upload,      // waits for segments
    block_upload_end,  // waits for the end request
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
  bool receive_stray(std::uint64_t word, Instant now);
  void send_abort(AbortCode code, Instant now, can::TransmitQueue& queue);
  void give_up(AbortCode why, Instant now, can::TransmitQueue& queue);
  bool may_have_taken_effect() const;
  bool has_sent_value() const;
  void finish_or_repeat(AbortCode code, Instant now, can::TransmitQueue& queue);
  void finish(AbortCode code);

  void extend_while_paced(Instant now);

  // --- client_unanswered.cpp -------------------------------------------------------------------
  // What may follow from a timed-out transfer.
  enum class Unanswered : std::uint8_t {
    nothing,
    under_way,  // its frames are not acknowledged yet
    due,        // their answer is expected
  };
  static Instant next_look(Instant now);
  bool is_under_way(const can::TransmitQueue& queue) const;
  void note_unanswered(Instant now, const can::TransmitQueue& queue);
  void note_answer(Instant now, can::TransmitQueue& queue);
  void follow_unanswered(Instant now, can::TransmitQueue& queue);
  void hold(std::uint64_t word, Instant now);

  // --- client_block.cpp ------------------------------------------------------------------------
  bool in_block() const { return state_ >= State::block_download_initiate; }
  bool worth_a_block(std::optional<std::uint32_t> size) const;
  void initiate_block(Instant now, can::TransmitQueue& queue);
  bool initiate_answer_lost(std::uint8_t command, Instant now) const;
  bool fits_block_initiate(std::uint8_t command) const;
  bool initiates_block() const;
  bool fall_back_unanswered(Instant now, can::TransmitQueue& queue);
  AbortCode block_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  bool fall_back(AbortCode code, Instant now, can::TransmitQueue& queue);
  bool is_repetition(std::uint64_t word, const can::TransmitQueue& queue) const;
  AbortCode block_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode block_acknowledged(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode proceed_with_block(AbortCode why, Instant now, can::TransmitQueue& queue);
  AbortCode block_segment_came(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  AbortCode block_upload_ended(std::uint64_t word, Instant now, can::TransmitQueue& queue);
  void acknowledge_block(Instant now, can::TransmitQueue& queue);
  AbortCode send_segments(Instant now, can::TransmitQueue& queue);
  void advance_block(Instant now, can::TransmitQueue& queue);
  Duration stall() const { return timeout_ * 2 / 5; }
  // A server may pause within a sub-block, so segments count as lost only after stall(), and
  // sub-blocks stay long even on a lossy bus.
  static constexpr std::uint8_t kFewestSegments = 64;

  State state_ = State::idle;
  bool toggle_ = false;  // of the segment under way
  unsigned strays_expected_ = 0;
  od::Address address_;
  bool writing_ = false;
  bool sent_before_ = false;      // an earlier attempt of this transfer sent the whole value
  od::ByteSink* into_ = nullptr;  // of an upload into a stream
  Duration timeout_{};
  TransferOptions options_;
  Instant deadline_ = kNever;
  std::uint64_t last_used_ = 0;  // the last processed answer, to detect its repetition
  Source source_;
  Sink sink_;
  Outbox outbox_;
  std::optional<Outcome> outcome_;

  const RequestsUnderWay* under_way_ = nullptr;
  std::uint8_t node_ = 0;
  Unanswered unanswered_ = Unanswered::nothing;
  bool answer_came_ = false;     // Unanswered::under_way: the answer preceded the acknowledgement
  Duration answer_time_{};       // duration of Unanswered::due
  Instant look_again_ = kNever;  // end of the state unanswered_, or time of the next check
  std::optional<std::uint64_t> held_;  // the first request, while it waits for unanswered_

  bool tried_block_ = false;                     // in this transfer
  bool blocks_refused_ = false;                  // by the server, as far as known
  bool block_unanswered_ = false;                // the previous block initiate was not answered
  std::optional<std::uint32_t> announced_size_;  // size indicated to a read that changes to blocks
  // block_download: time of the next segments; block_upload: time of a stall.
  Instant block_wake_ = kNever;
  BlockSender sender_;
  BlockReceiver receiver_;
  LateSegments late_;
};

}  // namespace linegate::sdo
