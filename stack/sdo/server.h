// SPDX-License-Identifier: Apache-2.0
// One SDO server (CiA 301, 7.2.4; object 1200h and following): gives clients access to a
// dictionary. Expedited, segmented and block transfer.
//
// An access that a hook of the object, or a stream that it gave, puts off (od::kLater) waits: the
// server has no answer until the hook has one, which advance() then sends. Other servers and
// services go on. The hook hears when the client gives up (abort, a new initiate) or
// options.answer_timeout is over. Within a sub-block the segments of a download go on to come; its
// acknowledgement waits.
//
// At most one transfer is under way. A new initiate drops the old transfer (but within a sub-block
// of a download, where it cannot be told from a segment), as does an abort of the client. An upload
// gives the bytes as they were at its initiate; a download changes the object when all has come,
// whole, or not at all. A DOMAIN whose hook gives a stream (od/stream.h) is transferred piece by
// piece, and may change meanwhile.
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
  Duration timeout = std::chrono::seconds(1);  // a transfer without a frame for so long is aborted
                                               // with 0504 0000h
  Duration stall = std::chrono::milliseconds(200);  // a sub-block without a segment for so long is
                                                    // acknowledged as it is; less than timeout
  Duration answer_timeout = std::chrono::seconds(10);  // a hook without an answer for so long is
                                                       // given up: abort 0504 0000h
  std::size_t max_transfer = std::size_t{128} * 1024;  // bytes of a value that is no stream; longer
                                                       // ones: abort 0504 0005h
};

class Server;

// Where what a server cannot serve itself goes: the network indication of a gateway (CiA 302-7),
// and after it, as long as the server is diverted, all its client sends. Answers go out through
// Server::respond().
class Detour {
 public:
  virtual ~Detour() = default;
  // A request with command specifier 7. What the server had under way is dropped.
  virtual void network_request(Server& server, std::uint64_t request, Instant now) = 0;
  // Any frame of the client of a diverted server.
  virtual void diverted_request(Server& server, std::uint64_t request, Instant now) = 0;
  // A diverted server was reset, and serves itself again.
  virtual void diverted_reset(Server& server) = 0;
};

struct ServerCounters {
  std::uint64_t uploads = 0;    // ended well
  std::uint64_t downloads = 0;  // ended well
  std::uint64_t aborts = 0;     // refused, dropped, stalled, or aborted by the client
  std::uint64_t malformed = 0;  // frames that are no SDO frames
};

class Server {
 public:
  // request: client to server, response: server to client (sub-indices 1 and 2 of the 12xxh
  // object). Only format and identifier of response are used; whoever owns the dispatch table
  // brings the requests. dictionary and events must outlive the server.
  Server(od::Dictionary& dictionary, can::CobId request, can::CobId response, EventLog& events,
         ServerOptions options = {});

  // A frame with the request identifier; frame.time is now. Frames that do not have 8 bytes are
  // counted, told as EventKind::malformed_frame and not processed. Answers to expedited requests
  // never allocate.
  void receive(const can::Frame& frame, can::TransmitQueue& queue);

  // The short way of receive() for what is asked most: an upload of up to four bytes that a glance
  // at the dictionary gives. False, and nothing is done, for any other frame, or if the answer
  // would have to wait. Hot.
  [[gnu::always_inline]] bool answer_at_once(std::uint64_t request, can::TransmitQueue& queue);

  // Aborts a stalled transfer, sends what did not fit into the queue and the segments of a block.
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // The protocol without the queue: takes a request of 8 bytes and gives whether there is an
  // answer, then in out (identifier, format, length and the first 8 bytes are set). The segments of
  // a block upload come from advance() alone.
  bool answer(const can::Frame& in, can::Frame& out);

  // detour gets what is not for this server; nullptr: that is refused. It must outlive the server.
  void set_detour(Detour* detour) { detour_ = detour; }
  // From now on the detour gets all requests, or (false) none but those for it.
  void divert(bool diverted);
  bool diverted() const { return state_ == State::diverted; }
  // Sends eight bytes on the server's identifier; false if there is no room in the queue.
  bool respond(std::uint64_t word, can::TransmitQueue& queue) const;

  // Forgets the transfer and unsent frames without a word (NMT reset, NMT stop).
  void reset();
  // reset(), then other identifiers (the 12xxh object was written).
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
    block_download_end,     // everything came: waiting for the end request
    block_upload_initiate,  // waiting for the client to start
    block_upload,           // sending a sub-block, or waiting for its acknowledgement
    block_upload_end,       // waiting for the answer to the end request
    waiting,                // for a hook, see Awaited
    diverted,               // see Detour
  };

  // What a hook's late answer is about.
  enum class Awaited : std::uint8_t {
    upload,
    block_upload,
    upload_segment,      // of a stream
    open_sink,           // at any initiate of a download
    download_segment,    // of a stream
    sub_block,           // of a stream
    expedited_download,  // these are to be stored
    last_segment,
    block_download_end,
  };

  // Requests and answers are the eight bytes of a frame as one number. False: no answer.
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
  bool block_acknowledged(std::uint64_t request, Instant now, std::uint64_t& reply);
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

  Instant block_wake_ = kNever;       // block_upload: more segments; block_download: it stalls
  std::uint64_t newest_request_ = 0;  // block_upload, waiting: to know its repetition
  BlockSender sender_;
  BlockReceiver receiver_;
  SegmentPace pace_;
  LateSegments late_;

  od::Ticket ticket_ = 0;  // of what was put off: waiting, or a stream within a sub-block
  Awaited awaited_ = Awaited::upload;

  Outbox outbox_;
  ServerCounters counters_;
  Detour* detour_ = nullptr;
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
