// One SDO server (CiA 301, 7.2.4; object 1200h and following): gives clients access to a
// dictionary. Expedited and segmented transfer; a request for block transfer is answered with abort
// 0504 0001h, upon which clients fall back to segments.
//
// At most one transfer is under way. A new initiate drops the old transfer, as does an abort of the
// client. An upload in segments gives the bytes as they were at its initiate; a download changes
// the object with its last segment, whole, or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/outbox.h"
#include "stack/sdo/transfer.h"

namespace linegate::sdo {

struct ServerOptions {
  Duration timeout = std::chrono::seconds(1);  // a segmented transfer without a frame for so long
                                               // is aborted with 0504 0000h
  std::size_t max_transfer = std::size_t{128} * 1024;  // bytes; longer ones: abort 0504 0005h
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

  // Aborts a stalled transfer and sends what did not fit into the queue.
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // The protocol without the queue: takes a request of 8 bytes and gives whether there is an
  // answer, then in out (identifier, format, length and the first 8 bytes are set).
  bool answer(const can::Frame& in, can::Frame& out);

  // Forgets the transfer and unsent frames without a word (NMT reset, NMT stop).
  void reset();
  // reset(), then other identifiers (the 12xxh object was written).
  void configure(can::CobId request, can::CobId response);

  can::CobId request_id() const { return request_; }
  can::CobId response_id() const { return outbox_.cob_id(); }
  bool busy() const { return state_ != State::idle; }
  const ServerCounters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t { idle, download_segments, upload_segments };

  // Requests and answers are the eight bytes of a frame as one number. False: no answer.
  bool serve(std::uint64_t request, Instant now, std::uint64_t& reply);
  std::uint64_t initiate_upload(std::uint64_t request, Instant now);
  std::uint64_t initiate_segmented_upload(od::Address address, std::span<const std::byte> value,
                                          Instant now);
  std::uint64_t upload_segment(std::uint64_t request, Instant now);
  std::uint64_t initiate_download(std::uint64_t request, Instant now);
  AbortCode expedited_download(std::uint64_t request, od::Address address);
  AbortCode initiate_segmented_download(std::uint64_t request, od::Address address, Instant now);
  std::uint64_t download_segment(std::uint64_t request, Instant now);
  AbortCode store();
  AbortCode check_segment(State wanted, std::uint64_t request) const;
  std::uint64_t refuse(od::Address address, AbortCode code);
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
  AbortCode over_limit_ = AbortCode::none;  // what exceeding the sink's limit means

  Outbox outbox_;
  ServerCounters counters_;
};

}  // namespace linegate::sdo
