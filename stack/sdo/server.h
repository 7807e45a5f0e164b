// SPDX-License-Identifier: Apache-2.0
// One SDO server (CiA 301, 7.2.4; object 1200h and following): gives clients access to a dictionary
// by expedited, segmented and block transfer.
//
// A hook of the object, or its stream, may defer its result (od::kLater): the server then waits,
// and advance() sends the answer when the result is available. Other servers and services continue.
// The hook is cancelled if the client gives up (abort, a new initiate) or options.answer_timeout
// expires. Within a sub-block of a download, segments continue to arrive; the acknowledgement
// waits.
//
// At most one transfer is under way. An abort of the client drops it, and so does a new initiate
// (except within a sub-block of a download, where an initiate looks like a segment). An upload
// returns the bytes as of its initiate; a download changes the object as a whole when all bytes
// have arrived, or not at all. A DOMAIN whose hook supplies a stream (od/stream.h) is transferred
// in pieces, and may change meanwhile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/assert.h"
#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/block.h"
#include "stack/sdo/outbox.h"
#include "stack/sdo/transfer.h"

namespace linegate::sdo {

struct ServerOptions {
  // A transfer without a frame for this long is aborted with 0504 0000h.
  Duration timeout = std::chrono::seconds(1);
  // A sub-block without a segment for this long is acknowledged as received so far; less than
  // timeout.
  Duration stall = std::chrono::milliseconds(200);
  // A hook without a result for this long is cancelled: abort 0504 0000h.
  Duration answer_timeout = std::chrono::seconds(10);
  // Largest value in bytes, except streams; longer values: abort 0504 0005h.
  std::size_t max_transfer = std::size_t{128} * 1024;
};

class Server;

// Handles requests that a server cannot serve itself: the network indication of a gateway (CiA
// 302-7), and after it, as long as the server is diverted, all frames of its client. Answers are
// sent with Server::respond().
class NetworkHandler {
 public:
  virtual ~NetworkHandler() = default;
  // A request with command specifier 7. The server's current transfer is dropped.
  virtual void network_request(Server& server, std::uint64_t request, Instant now) = 0;
  // Any frame from the client of a diverted server.
  virtual void diverted_request(Server& server, std::uint64_t request, Instant now) = 0;
  // A diverted server was reset, and serves its own requests again.
  virtual void diverted_reset(Server& server) = 0;
};

struct ServerCounters {
  std::uint64_t uploads = 0;    // ended without an error
  std::uint64_t downloads = 0;  // ended without an error
  std::uint64_t aborts = 0;     // refused, dropped, stalled, or aborted by the client
  std::uint64_t malformed = 0;  // frames that are not SDO frames
};

class Server {
 public:
  // request: identifier from client to server; response: from server to client (sub-indices 1 and 2
  // of the 12xxh object). Only format and identifier of response are used; the owner of the
  // dispatch table passes the requests. dictionary and events must outlive the server.
  Server(od::Dictionary& dictionary, can::CobId request, can::CobId response, EventLog& events,
         ServerOptions options = {});

  // Processes a frame with the request identifier; frame.time is the current time. Frames that do
  // not have 8 bytes are counted, reported as EventKind::malformed_frame and not processed. Answers
  // to expedited requests never allocate.
  void receive(const can::Frame& frame, can::TransmitQueue& queue);

  // Fast path of receive() for the most frequent request: an upload of up to four bytes that the
  // dictionary can supply directly. Returns false, without an effect, for any other frame, or if
  // the answer would have to wait. Hot.
  [[gnu::always_inline]] bool answer_at_once(std::uint64_t request, can::TransmitQueue& queue);

  // Aborts a stalled transfer, and sends the segments of a block and frames that did not fit into
  // the queue.
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // The protocol without the queue: processes a request of 8 bytes and returns whether out has an
  // answer (identifier, format, length and the first 8 bytes are set). The segments of a block
  // upload are sent only by advance().
  bool answer(const can::Frame& in, can::Frame& out);

  // handler receives the requests that are not for this server; nullptr: they are refused. It must
  // outlive the server.
  void set_network_handler(NetworkHandler* handler) { network_handler_ = handler; }
  // true: from now on handler receives all requests; false: only network indications.
  void divert(bool diverted);
  bool diverted() const { return state_ == State::diverted; }
  // Sends eight bytes on the server's identifier; false if the queue is full.
  bool respond(std::uint64_t word, can::TransmitQueue& queue) const;

  // Drops the transfer and unsent frames without an abort (NMT reset, NMT stop).
  void reset();
  // reset(), then changes the identifiers (the 12xxh object was written).
  void configure(can::CobId request, can::CobId response);

  can::CobId request_id() const { return request_; }
  can::CobId response_id() const { return outbox_.cob_id(); }
  bool busy() const {
    return state_ != State::idle && state_ != State::late_segments && state_ != State::diverted;
  }
  const ServerCounters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t {
    idle,
    download_segments,
    upload_segments,
    late_segments,  // idle, but segments of an aborted block download may still come
    block_download,
    block_download_end,     // all segments were received: waits for the end request
    block_upload_initiate,  // waits for the start request
    block_upload,           // sends a sub-block, or waits for its acknowledgement
    block_upload_end,       // waits for the answer to the end request
    waiting,                // for a deferred result, see Awaited
    diverted,               // see NetworkHandler
  };

  // The access whose result is deferred.
  enum class Awaited : std::uint8_t {
    upload,
    block_upload,
    upload_segment,      // of a stream
    open_sink,           // at any initiate of a download
    download_segment,    // of a stream
    sub_block,           // of a stream
    expedited_download,  // from here on: storing the value
    last_segment,
    block_download_end,
  };

  // Requests and answers are the eight bytes of a frame as one number. Returns false if there is no
  // answer.
  bool serve(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool serve_request(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool initiate_upload(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool answer_upload(std::uint64_t request, std::span<const std::byte> value, Instant now,
                     std::uint64_t& reply);
  bool answer_value(std::uint64_t request, std::span<const std::byte> value, Instant now,
                    std::uint64_t& reply);
  bool initiate_segmented_upload(std::uint64_t request, std::span<const std::byte> value,
                                 Awaited awaited, Instant now, std::uint64_t& reply);
  bool upload_segment(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool initiate_download(std::uint64_t request, Instant now, std::uint64_t& reply);
  AbortCode expedited_download(std::uint64_t request, od::Address address, Awaited& awaited);
  AbortCode write_stream(od::Address address, std::span<const std::byte> value, Awaited& awaited);
  AbortCode open_source(od::Address address, std::span<const std::byte> value);
  void uploaded();
  void close_streams(AbortCode why);
  AbortCode prepare_download(od::Address address, std::optional<std::uint32_t> announced);
  bool download_segment(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool segment_taken(std::uint64_t request, Instant now, std::uint64_t& reply);
  AbortCode store();
  AbortCode check_segment(State wanted, std::uint64_t request) const;
  std::uint64_t refuse(od::Address address, AbortCode code);

  // --- server_waiting.cpp -----------------------------------------------------------------------
  bool refuse_or_wait(od::Address address, AbortCode why, Awaited awaited, std::uint64_t request,
                      Instant now, std::uint64_t& reply);
  bool answered() const;
  void resume(Instant now, can::TransmitQueue& queue);
  bool finish_waiting(Instant now, std::uint64_t& reply);
  bool finish_upload(Instant now, std::uint64_t& reply);
  bool finish_storing(Instant now, std::uint64_t& reply);
  bool proceed_with_stream(Instant now, std::uint64_t& reply);
  void resume_sub_block(Instant now, can::TransmitQueue& queue);
  void give_up(AbortCode why);

  // --- server_block.cpp -------------------------------------------------------------------------
  bool in_block() const { return state_ >= State::late_segments; }
  bool serve_block(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool serve_unknown(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool serve_other(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool initiate_block(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool initiate_block_download(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool initiate_block_upload(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool answer_block_upload(std::uint64_t request, std::span<const std::byte> value, Instant now,
                           std::uint64_t& reply);
  bool block_segment(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool end_block_download(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool acknowledges_waiting_segments(std::uint64_t request, const can::TransmitQueue& queue) const;
  bool block_acknowledged(std::uint64_t request, Instant now, std::uint64_t& reply);
  bool proceed_with_block(AbortCode why, Instant now, std::uint64_t& reply);
  std::uint64_t refuse_block(AbortCode code, Instant now);
  std::uint64_t acknowledge_block(Instant now);
  void advance_block(Instant now, can::TransmitQueue& queue);
  void send_segments(Instant now, can::TransmitQueue& queue);
  void put_off_or_abort(AbortCode why, Instant now, can::TransmitQueue& queue);
  void expect_late_segments(Instant now);

  void begin(State state, od::Address address, Instant now);
  void proceed(Instant now);
  void drop();
  void end();

  od::Dictionary& dictionary_;
  EventLog& events_;
  ServerOptions options_;
  can::CobId request_;

  State state_ = State::idle;
  bool toggle_ = false;  // expected in the next segment request
  od::Address address_;  // of the transfer
  Instant deadline_ = kNever;
  Source source_;
  Sink sink_;

  // block_upload: time of the next segments; block_download: time of a stall.
  Instant block_wake_ = kNever;
  std::uint64_t newest_request_ = 0;  // block_upload, waiting: to detect its repetition
  BlockSender sender_;
  BlockReceiver receiver_;
  SegmentPace pace_;
  LateSegments late_;

  // Of the deferred result: in state waiting, or of a stream within a sub-block.
  od::Ticket ticket_ = 0;
  Awaited awaited_ = Awaited::upload;

  Outbox outbox_;
  ServerCounters counters_;
  NetworkHandler* network_handler_ = nullptr;
};

inline bool Server::answer_at_once(std::uint64_t request, can::TransmitQueue& queue) {
  if (state_ != State::idle || !outbox_.ready(queue) || !is_upload_initiate(request)) {
    return false;
  }
  const od::Glance value = dictionary_.glance(multiplexer(request));
  if (value.size == 0) {
    return false;
  }
  ++counters_.uploads;
  outbox_.send_at_once(expedited_answer(request, value.word, value.size), queue);
  return true;
}

inline void Server::end() {
  LINEGATE_ASSERT_HOT(ticket_ == 0, "no access waits at the end of a transfer");
  state_ = State::idle;
  address_ = {};
  deadline_ = kNever;
  block_wake_ = kNever;
}

inline void Server::drop() {
  if (busy()) [[unlikely]] {
    give_up(AbortCode::general);
  }
}

}  // namespace linegate::sdo
