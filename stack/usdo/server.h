// SPDX-License-Identifier: Apache-2.0
// The USDO server of a node (CiA 1301). It serves several clients at the same time, and several
// transfers of each, which differ in their session-IDs. Requests come on 600h + the node-ID of the
// client, and are for this server if byte 0 is its node-ID.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/usdo/outbox.h"
#include "stack/usdo/protocol.h"

namespace linegate::usdo {

struct ServerOptions {
  AbortForm abort_form = AbortForm::one_byte;
  // A transfer without a frame for this long is aborted.
  Duration timeout = std::chrono::seconds(1);
  // A hook without a result for this long is cancelled, and the transfer aborted. A value that the
  // hook may yet store has no abort of one byte: 60h would state that it is not stored.
  Duration answer_timeout = std::chrono::seconds(10);
  // Largest value in bytes, except streams.
  std::size_t max_transfer = std::size_t{16} * 1024 * 1024;
};

struct ServerCounters {
  std::uint64_t uploads = 0;    // ended without an error
  std::uint64_t downloads = 0;  // ended without an error
  std::uint64_t aborts = 0;     // refused, stalled, or aborted by the client
  std::uint64_t malformed = 0;  // frames that are not USDO frames
};

class Server {
 public:
  // Segmented transfers and deferred results at the same time. A further one is refused with 60h.
  static constexpr std::size_t kSessions = 16;

  // dictionary and events must outlive the server.
  Server(od::Dictionary& dictionary, std::uint8_t node_id, EventLog& events,
         ServerOptions options = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Processes a frame with the identifier 600h + node-ID of a client; frame.time is the current
  // time. Frames to other nodes, and to all (node-ID 0), are ignored. Frames that are not CAN FD or
  // have no session are counted, reported as EventKind::malformed_frame and not processed.
  //
  // Errors are answered with an abort and end the session: 13h unknown or misplaced command, 14h
  // segment counter, 15h a frame without all of its fields or bytes, 21h session 0 or a segment
  // without a transfer; 62h an object of which another client has a transfer; and the refusals of
  // the dictionary. An initiate replaces the transfer of its session, and an older one of its
  // client with the same object.
  void receive(const can::Frame& frame, can::TransmitQueue& queue);
  // Aborts stalled transfers, and sends deferred answers and frames that did not fit into the
  // queue.
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;
  // Drops all transfers and unsent frames without an abort (NMT reset, NMT stop). Hooks and streams
  // of the dictionary may call it, too: what they were called for is not answered then.
  void reset();

  std::size_t sessions() const { return sessions_.size(); }
  const ServerCounters& counters() const { return counters_; }

 private:
  struct Session;
  enum class Awaited : std::uint8_t;

  Route answer_route(const can::Frame& request) const;
  Session* find(const can::Frame& request) const;
  void drop_repeated(const can::Frame& request);
  // Whether its session waits for the result of an equal request.
  bool waits_for(const can::Frame& request) const;
  bool is_used_by_another(const can::Frame& request) const;
  Session* open(const can::Frame& request);
  void serve(const can::Frame& request);
  void serve_segment(const can::Frame& request);
  void upload(const can::Frame& request);
  void answer_upload(const can::Frame& request, std::span<const std::byte> value);
  void upload_segment(Session& session, const can::Frame& request);
  void download(const can::Frame& request);
  void initiate_download(const can::Frame& request);
  void download_piece(Session& session, const can::Frame& request);
  void piece_taken(Session& session, const can::Frame& request);
  void stored(Session& session, AbortCode why);
  void wait(Session& session, Awaited awaited, const can::Frame& request);
  void refuse_or_wait(Session& session, AbortCode why, Awaited awaited, const can::Frame& request);
  void resume(Session& session);
  void finish_storing(Session& session);
  bool answered(const Session& session) const;
  void send(const can::Frame& frame);
  void refuse(const can::Frame& request, AbortCode why);
  void refuse(const can::Frame& request, Code why);
  od::Address object_of(const can::Frame& request) const;
  void drop(Session* session, AbortCode why);
  void close(Session& session, AbortCode why);
  bool is_gone(Session& session);
  void remove(Session& session);
  void forget_removed();

  od::Dictionary& dictionary_;
  EventLog& events_;
  ServerOptions options_;
  std::uint8_t node_id_;
  std::vector<std::unique_ptr<Session>> sessions_;
  std::vector<std::unique_ptr<Session>> removed_;  // in the present call, which may still use them
  unsigned calls_ = 0;                             // under way
  FrameOutbox outbox_;
  ServerCounters counters_;
  can::TransmitQueue* queue_ = nullptr;  // of the present call
  Instant now_{};                        // of the present call
};

}  // namespace linegate::usdo
